"""Names the settings in which two resolved scenarios differ, for the error that refuses to overwrite a sequence."""

from __future__ import annotations

from typing import Any

from scenarios.loading.toml_files import Table
from scenarios.printable import shortened

MOST = 3  # differences that are named; the others are counted
LONGEST = 40  # characters of a value


def setting_differences(stored: Table, wanted: Table) -> str:
    """Returns the settings that differ between two scenarios, as "camera.fps 10 → 5, duration 20 → 30"."""
    before, after = (dict(_flat("", table)) for table in (stored, wanted))
    keys = [key for key in {**before, **after} if before.get(key) != after.get(key)]
    words = [f"{key} {_value(before, key)} → {_value(after, key)}" for key in keys[:MOST]]
    return ", ".join(words + [f"{len(keys) - MOST} more"] * (len(keys) > MOST))


def _flat(prefix: str, value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        dot = "." if prefix else ""
        return [pair for key, inner in value.items() for pair in _flat(f"{prefix}{dot}{key}", inner)]
    if isinstance(value, list) and any(isinstance(inner, dict) for inner in value):
        return [pair for k, inner in enumerate(value) for pair in _flat(f"{prefix}[{k}]", inner)]
    return [(prefix, value)]


def _value(settings: Table, key: str) -> str:
    value = settings.get(key, "none")
    return shortened(str(value).removesuffix(".0") if isinstance(value, float) else str(value), LONGEST)
