"""Scenario files: their keys, the catalogue, suites, loading and drawing. Imports neither `sim` nor `tracking`.

`scenarios.load("cross")` loads a scenario. `scenarios.load("cross", set=scenarios.sensor_settings("mine.toml"))` loads
it with the profile of a detector. Importing this package alone imports nothing heavy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.loading.resolve import load, sensor_settings

__all__ = ["load", "sensor_settings"]

_HOME = {"load": "scenarios.loading.resolve", "sensor_settings": "scenarios.loading.resolve"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'scenarios' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOME[name]), name)
