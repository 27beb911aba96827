"""The world: crowds, cameras, sensors, truth, and how sequences are stored and read.

`sim.simulate(scenario, seed)` is the whole of it, and `sim.replay(recording, camera)` for people who were filmed;
nothing heavy is imported before it is asked for.
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
