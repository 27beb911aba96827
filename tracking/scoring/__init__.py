"""Scores of people, groups and events; usable alone, with numpy and scipy only.

`evaluate` scores one tracker's `Tracks` against a `Truth`, `score_arrays` plain arrays. Both return `Scores`, a mapping
from the name of a score to its value. `pooled` makes the scores of several sequences together of those of each.
"""

from tracking.scoring.evaluation import evaluate
from tracking.scoring.pooling import pooled
from tracking.scoring.user_arrays import score_arrays

__all__ = ["evaluate", "pooled", "score_arrays"]
