"""The simulator: crowds, cameras, detectors and truth, and how sequences are stored and read.

`sim.simulate(scenario, seed)` returns a simulated sequence, `sim.replay(recording, camera)` a sequence that shows the
people of a recording. Both are imported on first use, so `import sim` alone is quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.dataset.replay import replay
    from sim.sequence import simulate

__all__ = ["replay", "simulate"]

_HOME = {"replay": "sim.dataset.replay", "simulate": "sim.sequence"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sim' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
