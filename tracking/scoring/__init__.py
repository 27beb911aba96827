"""Scores of people, groups and events; usable alone, with numpy and scipy only.

`evaluate` scores one tracker's `Tracks` against a `Truth`, `score_arrays` plain arrays. Both return `Scores`, a mapping
from the name of a score to its value. `pooled` makes the scores of several sequences together of those of each. Each is
imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracking.scoring.evaluation import evaluate
    from tracking.scoring.pooling import pooled
    from tracking.scoring.user_arrays import score_arrays

__all__ = ["evaluate", "pooled", "score_arrays"]

_HOME = {"evaluate": "evaluation", "pooled": "pooling", "score_arrays": "user_arrays"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
