"""Datasets on disk: many sequences, generated from scenarios or replayed from recordings."""
