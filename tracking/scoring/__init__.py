"""Scores of people, groups and events; imports numpy and scipy only."""

from tracking.scoring.arrays import score_arrays
from tracking.scoring.evaluation import evaluate

__all__ = ["evaluate", "score_arrays"]
