"""`flockscope scenarios --schema`: lists every key of a scenario file, read from the schema of its models."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from scenarios.schema.scenario import Scenario
from tracking.app.command_result import CommandResult

Node = dict[str, Any]
"""A part of a JSON schema."""


def list_keys() -> CommandResult:
    """Returns every key of a scenario file with its type, default and meaning, a line each."""
    schema = Scenario.model_json_schema(by_alias=True)
    rows = list(_keys(schema, schema["$defs"], ""))
    width = max(len(row["key"]) for row in rows)
    text = "\n".join(f"{row['key']:<{width}}  {row['type']}; {row['default']}; {row['meaning']}" for row in rows)
    return CommandResult({"keys": rows}, text)


def _keys(table: Node, known: Node, prefix: str) -> Iterator[dict[str, str]]:
    required = table.get("required", [])
    for name, node in table["properties"].items():
        many = "[]" if any("items" in each for each in (node, *node.get("anyOf", ()))) else ""
        tables = list(_tables(node, known))
        for inner in tables:
            which = f"({inner['properties']['type']['const']})" if len(tables) > 1 else ""
            yield from _keys(inner, known, f"{prefix}{name}{many}{which}.")
        if not tables:
            default = "required" if name in required else _default(node)
            yield {
                "key": prefix + name, "type": _type(node), "default": default, "meaning": node.get("description", "")
            }  # fmt: skip


def _tables(node: Node, known: Node) -> Iterator[Node]:
    ref = node.get("$ref", "").rpartition("/")[2]
    if ref and ref != "Distribution":
        yield known[ref]
    for inner in [node.get("items", {}), *node.get("anyOf", ()), *node.get("oneOf", ())]:
        if inner:
            yield from _tables(inner, known)


def _type(node: Node) -> str:
    if "$ref" in node:
        return str(node["$ref"]).rpartition("/")[2].lower()
    for choices in (node.get("enum"), [node["const"]] if "const" in node else None):
        if choices:
            return " | ".join(map(json.dumps, choices))
    if "anyOf" in node:
        return " or ".join(_type(inner) for inner in node["anyOf"] if inner.get("type") != "null")
    if "prefixItems" in node:
        return f"[{', '.join(map(_type, node['prefixItems']))}]"
    return f"[{_type(node['items'])}, …]" if "items" in node else str(node.get("type", "value"))


def _default(node: Node) -> str:
    value = node.get("default")
    if isinstance(value, dict):
        value = {key: v for key, v in value.items() if v is not None}
    return "absent" if value is None else f"default {json.dumps(value)}"
