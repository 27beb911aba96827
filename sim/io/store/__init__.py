"""Our own files: one folder per sequence, and the tracks of a run."""
