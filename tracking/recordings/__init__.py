"""Recordings and texts of other people: one reader for each format, and `source`, which opens any path."""
