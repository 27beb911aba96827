"""A resolved scenario as TOML: every default spelt out, always the same bytes, loads back equal."""

from __future__ import annotations

import json
from typing import Any

from scenarios.schema import Scenario


def dump(scenario: Scenario) -> str:
    """The scenario as TOML text."""
    table = scenario.model_dump(mode="python", by_alias=True, exclude_none=True)
    flat = [(k, v) for k, v in table.items() if not _is_table(v) and not _is_rows(v)]
    blocks = [_lines(dict(flat))]
    for key, value in table.items():
        if _is_table(value):
            blocks.append(f"[{key}]\n" + _lines(value))
        elif _is_rows(value):
            blocks += [f"[[{key}]]\n" + _lines(row) for row in value]
    return "\n".join(blocks)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict)


def _is_rows(value: Any) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], dict)


def _lines(table: dict[str, Any]) -> str:
    return "".join(f"{key} = {_value(v)}\n" for key, v in table.items())


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(v)}" for key, v in value.items()) + " }"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value)
