"""Scores of people, groups and events; usable alone, with numpy and scipy only.

`evaluate` scores one tracker's `Tracks` against a `Truth`, `score_arrays` plain arrays. Both return `Scores`, a mapping
from the name of a score to its value.
"""

from tracking.scoring.evaluation import evaluate
from tracking.scoring.user_arrays import score_arrays

__all__ = ["evaluate", "score_arrays"]
