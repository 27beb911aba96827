"""The world: crowds, cameras, sensors, truth, and how sequences are stored and read.

`sim.simulate(scenario, seed)` is the whole of it; nothing heavy is imported before it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.sequence import simulate

__all__ = ["simulate"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'sim' has no attribute {name!r}")
    from sim import sequence

    return getattr(sequence, name)
