"""From frames to scores: detectors, trackers, grouping, scoring, tuning, the commands.

`tracking.track(tracker, sequence)` returns a run's tracks, `tracking.group(sequence)` the groups of labelled people,
`tracking.evaluate(truth, tracks)` the scores of either, `tracking.compare(sequences, runs)` a ranking of several runs,
and `tracking.tune(tracker, suite)` searches parameters. Each is imported when it is first used.
`import tracking` also registers the Gymnasium environment (tracking.environment.registration).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tracking.environment.registration import register_when_imported

if TYPE_CHECKING:
    from tracking.comparison import compare
    from tracking.running.run import group, track
    from tracking.scoring import evaluate
    from tracking.tuning.search import tune

__all__ = ["compare", "evaluate", "group", "track", "tune"]

register_when_imported()

_HOME = {
    "compare": "tracking.comparison",
    "evaluate": "tracking.scoring",
    "group": "tracking.running.run",
    "track": "tracking.running.run",
    "tune": "tracking.tuning.search",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tracking' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
