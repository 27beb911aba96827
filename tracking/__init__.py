"""From frames to scores: detectors, trackers, grouping, scoring, the commands.

`tracking.track(tracker, sequence)` and `tracking.evaluate(truth, tracks)` are the whole of it, `tracking.tune(tracker,
suite)` a search around them; nothing heavy is imported before it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tracking.gymnasium_registration import announce

if TYPE_CHECKING:
    from tracking.run import track
    from tracking.scoring import evaluate
    from tracking.tuning import tune

__all__ = ["evaluate", "track", "tune"]

announce()

_HOME = {"evaluate": "tracking.scoring", "track": "tracking.run", "tune": "tracking.tuning"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tracking' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
