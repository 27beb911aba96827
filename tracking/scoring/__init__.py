"""Scores of people, groups and events; imports numpy and scipy only."""

from tracking.scoring.evaluation import evaluate

__all__ = ["evaluate"]
