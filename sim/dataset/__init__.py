"""Datasets on disk: many sequences in one folder, simulated from scenarios or replayed from the motion of
recordings."""
