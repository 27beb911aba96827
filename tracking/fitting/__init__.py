"""Fits tables to data: a detector's profile, the belief of belonging, events of `joint`, speeds of `relational`."""
