"""The tuning objective alone, computed quickly and repeatedly on one truth; equal to the objective of `evaluate`."""

from tracking.objective.objective_scorer import ObjectiveScorer

__all__ = ["ObjectiveScorer"]
