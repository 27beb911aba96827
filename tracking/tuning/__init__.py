"""Search of a tracker's parameters on simulated scenes, judged on other scenes (docs/reference/tuning.md).

`tracking.tuning.tune` is imported on first use: the command line reads tracking.tuning.options without numpy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracking.tuning.search import tune

__all__ = ["tune"]


def __getattr__(name: str) -> Any:
    if name != "tune":
        raise AttributeError(f"module 'tracking.tuning' has no attribute {name!r}")
    from tracking.tuning.search import tune

    return tune
