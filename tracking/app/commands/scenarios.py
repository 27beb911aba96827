"""`flockscope scenarios`: lists scenarios, suites or the keys of a scenario file; explains one in words."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.loading.resolve import dump, load, names, read_suite, resolve, suite_file, suite_names
from scenarios.loading.toml_files import SUITES
from scenarios.schema.scenario import Scenario
from tracking.app.command_options import ScenariosOptions
from tracking.app.command_result import CommandResult
from tracking.app.option_parsing import output_file, scenario_settings

Node = dict[str, Any]  # A part of a JSON schema.


def scenarios(options: ScenariosOptions) -> CommandResult:
    """Explains the named scenario or suite; without a name lists all, or with --schema the keys of a scenario file."""
    if options.name is not None and not options.schema:
        return explain(options.name, options.settings, options.out)
    unused = {"NAME": options.name, "--out": options.out, "--set": options.settings}
    for option, value in unused.items():
        if value:
            got, remedy = f"{option} without a scenario to explain", "name a scenario, and leave --schema out"
            raise InputError(place=option, got=got, expected="NAME", remedy=remedy)
    return list_keys() if options.schema else catalogue()


def catalogue() -> CommandResult:
    """Returns every scenario and suite of the catalogue with its line of description, sorted by name."""
    scenarios = {name: load(name).about for name in names()}
    suites = {name: read_suite(SUITES / f"{name}.toml").about for name in suite_names()}
    text = ["Scenarios", *_rows(scenarios), "", "Suites", *_rows(suites)]
    return CommandResult({"scenarios": scenarios, "suites": suites}, "\n".join(text))


def explain(name: str, settings: list[str], drawing: Path | None) -> CommandResult:
    """Returns a scenario in words with its plan, which it writes to `drawing` (SVG), or a suite's entries."""
    from scenarios.drawing.plan import svg
    from scenarios.drawing.words import text

    entries = resolve(name, scenario_settings(settings))
    if suite_file(name) is not None:
        if drawing is not None:
            got, remedy = f"the suite {name}", "name one of its entries"
            raise InputError(place="--out", got=got, expected="one scenario", remedy=remedy)
        rows = {entry.name: entry.scenario.about for entry in entries}
        shown = "\n".join([f"{name}: {len(rows)} entries", *_rows(rows)])
        return CommandResult({"name": name, "entries": rows}, shown)
    scenario = entries[0].scenario
    words = text(scenario)
    data = {"name": scenario.name, "about": scenario.about, "text": words, "toml": dump(scenario)}
    if drawing is None:
        return CommandResult(data, words)
    from sim.io.files.atomic import write_file

    write_file(output_file(drawing, ".svg"), svg(scenario).encode())
    return CommandResult({**data, "drawing": drawing}, f"{words}\n{drawing}")


def _rows(about: dict[str, str]) -> list[str]:
    width = max(map(len, about), default=0)
    return [f"  {name:<{width}}  {words}".rstrip() for name, words in about.items()] or ["  none"]


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
    for choices in (node.get("anyOf"), node.get("oneOf")):
        if choices:
            return " or ".join(_type(inner) for inner in choices if inner.get("type") != "null")
    if "prefixItems" in node:
        return f"[{', '.join(map(_type, node['prefixItems']))}]"
    return f"[{_type(node['items'])}, …]" if "items" in node else str(node.get("type", "value"))


def _default(node: Node) -> str:
    value = node.get("default")
    if isinstance(value, dict):
        value = {key: v for key, v in value.items() if v is not None}
    return "absent" if value is None else f"default {json.dumps(value)}"
