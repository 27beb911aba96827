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
    """Returns every key of a scenario file with its type, default and meaning, a line each.

    The result's data: "keys", a list of dictionaries with "key", "type", "default" and "meaning". Keys of inner tables
    have dots. `[]` after a table's key stands for every element of its array. A word in parentheses names one of the
    kinds of table that the key can hold.
    """
    schema = Scenario.model_json_schema(by_alias=True)
    rows = list(_keys(schema, schema["$defs"], ""))
    width = max(len(row["key"]) for row in rows)
    text = "\n".join(f"{row['key']:<{width}}  {row['type']}; {row['default']}; {row['meaning']}" for row in rows)
    return CommandResult({"keys": rows}, text)


def _keys(table: Node, known: Node, prefix: str) -> Iterator[dict[str, str]]:
    """Yields a dictionary with "key", "type", "default" and "meaning", all texts, of each key of a table and of tables
    in it.

    table: part of a JSON schema. known: the schema's named tables. prefix: written before each key, "" or with a dot at
    the end. default: "required" if the key has none. A key that holds tables is replaced by their keys.
    """
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
    """Yields the tables (parts of a JSON schema) that a key can hold, directly or in an array; none for a plain value.

    node: the key's part of the schema. known: the schema's named tables. A distribution of random numbers counts as a
    plain value.
    """
    ref = node.get("$ref", "").rpartition("/")[2]
    if ref and ref != "Distribution":
        yield known[ref]
    for inner in [node.get("items", {}), *node.get("anyOf", ()), *node.get("oneOf", ())]:
        if inner:
            yield from _tables(inner, known)


def _type(node: Node) -> str:
    """Returns the type of a value in words. node: the value's part of a JSON schema.

    It is the name of a named type in lower case, the choices as JSON ("a" | "b"), the alternatives ("x or y", null left
    out), the elements ("[x, …]"), or the JSON type; "value" if there is none.
    """
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
    """Returns the default in words, "default" and the value as JSON; "absent" if there is none or it is None.

    node: the value's part of a JSON schema. Keys of a default table that are None are left out.
    """
    value = node.get("default")
    if isinstance(value, dict):
        value = {key: v for key, v in value.items() if v is not None}
    return "absent" if value is None else f"default {json.dumps(value)}"
