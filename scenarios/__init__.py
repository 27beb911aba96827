"""The scripts: scenario files, their strict form, the catalogue and the suites. Imports nothing of ours.

`scenarios.load("cross")` is the whole of it; nothing heavy is imported before it is asked for. A detector's profile
goes with it as `scenarios.load("cross", set=scenarios.sensor_settings("mine.toml"))`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.loading.resolve import load
    from scenarios.loading.sensor_profiles import sensor_settings

__all__ = ["load", "sensor_settings"]

_HOME = {"load": "scenarios.loading.resolve", "sensor_settings": "scenarios.loading.sensor_profiles"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'scenarios' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
