"""Tables learned from recordings: so far a detector's profile (`flockscope fit sensor`)."""
