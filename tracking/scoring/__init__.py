"""Scores of people, groups and events; usable alone, with numpy and scipy only."""

from tracking.scoring.evaluation import evaluate
from tracking.scoring.user_arrays import score_arrays

__all__ = ["evaluate", "score_arrays"]
