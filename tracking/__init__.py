"""From frames to scores: detectors, trackers, grouping, scoring, tuning, the commands.

`tracking.track(tracker, sequence)` returns a run's tracks, `tracking.group(sequence)` the groups of labelled people,
`tracking.evaluate(truth, tracks)` the scores of either, `tracking.compare(sequences, runs)` a ranking of several runs,
and `tracking.tune(tracker, suite)` searches parameters. Each is imported when it is first used.
`import tracking` also registers the Gymnasium environment (tracking.environment).
"""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

ROOT = Path(__file__).resolve().parents[1]


def _import_beside(name: str) -> None:
    """Imports the package `name` of this project, also if a file in the working folder has its name."""
    sys.path.insert(0, str(ROOT))
    try:
        found = str(import_module(name).__file__)
    finally:
        sys.path.remove(str(ROOT))
    if Path(found).resolve().parents[1] != ROOT:
        raise ImportError(f"{found} was imported in place of {ROOT / name}: rename it, or import tracking before it")


for package in ("scenarios", "sim"):
    _import_beside(package)

from tracking.environment import register_when_imported  # noqa: E402

if TYPE_CHECKING:
    from tracking.comparison import compare
    from tracking.running.live import Live
    from tracking.running.run import group, track
    from tracking.scoring import evaluate
    from tracking.tuning.search import tune

__all__ = ["Live", "compare", "evaluate", "group", "track", "tune"]

register_when_imported()

_HOME = {
    "Live": "tracking.running.live",
    "compare": "tracking.comparison",
    "evaluate": "tracking.scoring",
    "group": "tracking.running.run",
    "track": "tracking.running.run",
    "tune": "tracking.tuning.search",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tracking' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
