"""The parts of the pages that are made from the code, by name: commands, keys, scores, parameters, docstrings."""

from __future__ import annotations

import ast
import inspect
import json
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from typing import Any

from benchmarks.pages.markdown import cell, prose, row, table
from benchmarks.pages.places import CONFIGS, DOCSTRINGS
from benchmarks.pages.python_names import section
from benchmarks.pages.results_in_words import comparisons, tuning

ROOT = Path(__file__).resolve().parents[2]


def commands() -> str:
    """Returns a section for each command: its help, and a table of its arguments and options."""
    root: Any = import_module("typer").main.get_command(import_module("tracking.app.cli").app)
    return "\n\n".join(_command(name, command) for name, command in _commands(root, ""))


def _commands(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, f"{prefix}{name} ")
        else:
            yield f"{prefix}{name}", command


def _command(name: str, command: Any) -> str:
    context = command.context_class(command, info_name=name)
    records = ((p.param_type_name, p.get_help_record(context)) for p in command.params)
    # Of an argument Typer writes its type, too, as in `SOURCE <path>`.
    named = [(r[0].partition(" <")[0] if kind == "argument" else r[0], r[1]) for kind, r in records if r]
    rows = [row(f"`{cell(option)}`", cell(text)) for option, text in named]
    options = table("argument or option", "meaning", rows=rows)
    return f"## {name}\n\n{inspect.cleandoc(command.help)}\n\n{options}"


def keys_of_scenarios() -> list[dict[str, str]]:
    """Returns every key of a scenario file with its type, default and meaning, from the JSON schema."""
    schema = import_module("scenarios.schema.scenario").Scenario.model_json_schema(by_alias=True)
    return list(_keys(schema, schema["$defs"], ""))


def _keys(table: dict[str, Any], known: dict[str, Any], prefix: str) -> Iterator[dict[str, str]]:
    required = table.get("required", [])
    for name, node in table["properties"].items():
        many = "[]" if any("items" in each for each in (node, *node.get("anyOf", ()))) else ""
        tables = list(_tables(node, known))
        for inner in tables:
            kind = inner["properties"].get("type") or inner["properties"].get("kind", {})
            which = f"({kind['const']})" if len(tables) > 1 else ""
            yield from _keys(inner, known, f"{prefix}{name}{many}{which}.")
        if not tables:
            default = "required" if name in required else _default(node)
            yield {
                "key": prefix + name, "type": _type(node), "default": default, "meaning": node.get("description", "")
            }  # fmt: skip


def _tables(node: dict[str, Any], known: dict[str, Any]) -> Iterator[dict[str, Any]]:
    ref = node.get("$ref", "").rpartition("/")[2]
    if ref and ref not in ("Distribution", "Schedule"):
        yield known[ref]
    for inner in [node.get("items", {}), *node.get("anyOf", ()), *node.get("oneOf", ())]:
        if inner:
            yield from _tables(inner, known)


def _type(node: dict[str, Any]) -> str:
    if "$ref" in node:
        return str(node["$ref"]).rpartition("/")[2].lower()
    for choices in (node.get("enum"), [node["const"]] if "const" in node else None):
        if choices:
            return " or ".join(map(json.dumps, choices))
    for choices in (node.get("anyOf"), node.get("oneOf")):
        if choices:
            return " or ".join(_type(inner) for inner in choices if inner.get("type") != "null")
    if "prefixItems" in node:
        return f"[{', '.join(map(_type, node['prefixItems']))}]"
    return f"[{_type(node['items'])}, …]" if "items" in node else str(node.get("type", "value"))


def _default(node: dict[str, Any]) -> str:
    value = node.get("default")
    if isinstance(value, dict):
        value = {key: v for key, v in value.items() if v is not None}
    return "absent" if value is None else json.dumps(value)


def scenario_keys() -> str:
    """Returns a table for each table of a scenario file: its keys with type, default and meaning."""
    tables: dict[str, list[str]] = {}
    for k in keys_of_scenarios():
        cells = (f"`{k['key']}`", cell(k["meaning"]), cell(k["type"]), cell(k["default"]))
        tables.setdefault(k["key"].rpartition(".")[0], []).append(row(*cells))
    return "\n\n".join(
        f"### {f'`{name}`' if name else 'The file itself'}\n\n{table('key', 'meaning', 'type', 'default', rows=rows)}"
        for name, rows in tables.items()
    )


def catalogue() -> str:
    """Returns the table of the scenarios that come with flockscope."""
    resolve = import_module("scenarios.loading.resolve")
    rows = []
    for name in resolve.names():
        scenario = resolve.load(name)
        orders = ", ".join(sorted({order.type for order in scenario.event})) or "–"
        rows.append(row(f"`{name}`", scenario.about, f"{scenario.duration:g}", orders))
    return table("scenario", "what happens, and whose claim it tests", "s", "orders", rows=rows)


def suites() -> str:
    """Returns the table of the suites that come with flockscope."""
    resolve = import_module("scenarios.loading.resolve")
    rows = [
        row(
            f"`{name}`",
            str(len(resolve.resolve(f"suite:{name}"))),
            resolve.read_suite(resolve.suite_file(name)).about,
        )
        for name in resolve.suite_names()
    ]
    return table("suite", "entries", "what it is", rows=rows)


def scores() -> str:
    """Returns the table of all scores; a score without some frames stands beside the score that it is made of."""
    found = {score.key: score for score in import_module("tracking.scoring.catalogue").ALL}
    rows = []
    for s in (score for key, score in found.items() if not key.endswith("_core")):
        low, high = (f"{v:g}".replace("inf", "∞").replace("-", "−") for v in (s.low, s.high))
        core = f", `{s.key}_core`" if f"{s.key}_core" in found else ""
        kind = f"{'share' if s.unit == '1' else s.unit.replace('|', 'or')}, {low} to {high}, {s.better}"
        source = f" ({s.source})" if s.source else ""
        meaning = cell(s.meaning).replace("2 matched /", "2 [matched](#how-events-are-compared) /")
        rows.append(row(f"`{s.key}`{core}", f"{meaning}{source}", kind))
    return table("key", "meaning (source)", "unit, range, better", rows=rows)


def observations() -> str:
    """Returns the table of the statistics that the environment observes."""
    rows = [
        row(str(k), f"`{s.name}`", "share" if s.half is None else f"{s.half:g} {s.unit}".strip(), s.meaning)
        for k, s in enumerate(import_module("tracking.running.signals").STATISTICS)
    ]
    return table("", "statistic", "0.5 stands for", "meaning", rows=rows)


def axes() -> str:
    """Returns the table of the axes of difficulty."""
    found = import_module("tracking.stress.axes").AXES.values()
    rows = [row(f"`{axis.name}`", f"{axis.easy:g}", f"{axis.hard:g}", axis.about) for axis in found]
    return table("axis", "easy", "hard", "value", rows=rows)


def parameters(name: str) -> str:
    """Returns the table of the parameters of a config: meaning, default, values of presets that differ, range."""
    module, _, config = CONFIGS[name].partition(":")
    kind = getattr(import_module(module), config)
    names = import_module("tracking.config").presets(kind.tracker)
    presets = {preset: kind.load(preset).as_dict() for preset in names}
    rows = []
    for p in kind.params().values():
        span = ", ".join(f"`{c}`" for c in p.choices) if p.choices else f"{p.low:g} to {p.high:g}"
        span = " ".join(filter(None, [span, p.unit, "(log)" if p.scale == "log" else ""]))
        given = ["" if values[p.name] == p.default else _shown(values[p.name]) for values in presets.values()]
        rows.append(row(f"`{p.name}`", cell(p.meaning), _shown(p.default), *given, span))
    named = (f"preset `{preset}`" for preset in presets)
    return table("parameter", "meaning", "default", *named, "range and unit", rows=rows)


def _shown(value: object) -> str:
    """Returns a value of a parameter; the numbers of a vector with commas."""
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def constants(name: str) -> str:
    """Returns the constants of a tracker's package: numbers with an upper-case name and a comment behind or above."""
    module = CONFIGS[name].partition(":")[0].rpartition(".")[0]
    rows = []
    for path in sorted((ROOT / module.replace(".", "/")).glob("*.py")):
        source = path.read_text(encoding="utf-8")
        found = _constants(ast.parse(source).body, source.splitlines())
        rows += [row(f"`{key}`", cell(meaning), f"{value:g}", f"`{path.stem}`") for key, value, meaning in found]
    return table("constant", "meaning", "value", "module", rows=rows)


def _constants(body: list[ast.stmt], lines: list[str]) -> Iterator[tuple[str, float, str]]:
    for statement in body:
        if isinstance(statement, ast.Assign) and (meaning := _comment(statement.lineno - 1, lines)):
            target, value = statement.targets[0], statement.value
            targets = target.elts if isinstance(target, ast.Tuple) else [target]
            values = value.elts if isinstance(value, ast.Tuple) else [value]
            for one, number in zip(targets, values, strict=False):
                match one, number:
                    case ast.Name(name), ast.Constant(int() | float() as size) if name.isupper():
                        yield name, size, meaning


def _comment(place: int, lines: list[str]) -> str:
    """Returns the comment behind a line, else the one in the lines above it, else ""."""
    _, mark, behind = lines[place].partition("  # ")
    above = list(takewhile(lambda line: line.startswith("# "), reversed(lines[:place])))
    return behind if mark else " ".join(line[2:] for line in reversed(above))


def docstring(name: str) -> str:
    """Returns the docstring of a module without its first paragraph."""
    module, heading = DOCSTRINGS[name]
    return prose(inspect.cleandoc(import_module(module).__doc__ or "").partition("\n\n")[2], heading)


def preset(name: str) -> str:
    """Returns the file of a preset, PRESET/TRACKER."""
    text = (ROOT / "tracking" / "presets" / f"{name}.toml").read_text(encoding="utf-8")
    return f"```toml\n{text}```"


PARTS: dict[str, Callable[..., str]] = {
    "axes": axes,
    "catalogue": catalogue,
    "commands": commands,
    "comparisons": comparisons,
    "constants": constants,
    "docstring": docstring,
    "observations": observations,
    "parameters": parameters,
    "preset": preset,
    "python": section,
    "scenario-keys": scenario_keys,
    "scores": scores,
    "suites": suites,
    "tuning": tuning,
}
