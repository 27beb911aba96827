"""A resolved scenario as TOML: every default spelt out, always the same bytes, loads back equal."""

from __future__ import annotations

import json
from typing import Any

from pydantic import BaseModel


def dump(scenario: BaseModel) -> str:
    """The scenario, or another form of such tables, as TOML text."""
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
    return "".join(f"{key} = {value(v)}\n" for key, v in table.items())


def value(v: Any) -> str:
    """A value as TOML, on one line."""
    if isinstance(v, bool):
        return str(v).lower()
    if isinstance(v, str):
        return json.dumps(v, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{key} = {value(inner)}" for key, inner in v.items()) + " }"
    if isinstance(v, tuple | list):
        return "[" + ", ".join(map(value, v)) + "]"
    return repr(v)
