"""Search of a tracker's parameters on simulated scenes, judged on other scenes (docs/reference/tuning.md)."""
