"""Fits a detector's profile, the `[sensor]` table, to labelled recordings (`flockscope fit sensor`)."""
