"""The scripts: scenario files, their strict form, the catalogue and the suites. Imports nothing of ours.

`scenarios.load("cross")` is the whole of it; nothing heavy is imported before it is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.loading import load

__all__ = ["load"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'scenarios' has no attribute {name!r}")
    from scenarios import loading

    return getattr(loading, name)
