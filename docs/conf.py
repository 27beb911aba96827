"""Sphinx configuration of the site (`make docs`), and the parts of its pages that are made from the code.

A page asks for such a part with the comment `<!-- generated: NAME -->` or `<!-- generated: NAME ARGUMENT -->` on a line
of its own; PARTS has the names. A line below it, which the part replaces, says on a code host where the text is.
`<!-- pages TITLE: a b -->` puts pages into the navigation.
"""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from itertools import takewhile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

project = "flockscope"
author = "flockscope maintainers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
root_doc = "index"
html_theme = "furo"
html_title = "flockscope"
html_show_sphinx = False
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
highlight_language = "none"
smartquotes = False  # They would make a dash of `--`.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "html_image"]
nitpicky = True
# Without an entry: types of other projects, tables of scenario files (their page has them), parts of results.
nitpick_ignore_regex = [
    ("py:.*", r"(?!(scenarios|sim|tracking)\.).*"),
    ("py:class", r"scenarios\.schema\.(values|sensor|picture|scenario)\.(?!Scenario$|ObservationSpec$)\w+"),
    ("py:class", r"tracking\.(tuning\.(candidates|search_plan)|grouping\.belief)\.(?!Belief$)\w+"),
]
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False

PUBLIC = ("scenarios", "sim", "tracking", "tracking.scoring")
"""Packages of which everything in `__all__` must stand on a page."""


def commands() -> str:
    """Returns a section for each command: its help, and a table of its arguments and options."""
    root: Any = import_module("typer").main.get_command(import_module("tracking.app.cli").app)
    return "\n".join(_section(name, command) for name, command in _commands(root, ""))


def _commands(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, f"{prefix}{name} ")
        else:
            yield f"{prefix}{name}", command


def _section(name: str, command: Any) -> str:
    context = command.context_class(command, info_name=name)
    records = (parameter.get_help_record(context) for parameter in command.params)
    rows = [f"| `{_cell(option)}` | {_cell(text)} |" for option, text in filter(None, records)]
    return "\n".join([f"## {name}", "", command.help, "", table("argument or option", "meaning", rows=rows), ""])


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


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
            which = f"({inner['properties']['type']['const']})" if len(tables) > 1 else ""
            yield from _keys(inner, known, f"{prefix}{name}{many}{which}.")
        if not tables:
            default = "required" if name in required else _default(node)
            yield {
                "key": prefix + name, "type": _type(node), "default": default, "meaning": node.get("description", "")
            }  # fmt: skip


def _tables(node: dict[str, Any], known: dict[str, Any]) -> Iterator[dict[str, Any]]:
    ref = node.get("$ref", "").rpartition("/")[2]
    if ref and ref != "Distribution":
        yield known[ref]
    for inner in [node.get("items", {}), *node.get("anyOf", ()), *node.get("oneOf", ())]:
        if inner:
            yield from _tables(inner, known)


def _type(node: dict[str, Any]) -> str:
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


def _default(node: dict[str, Any]) -> str:
    value = node.get("default")
    if isinstance(value, dict):
        value = {key: v for key, v in value.items() if v is not None}
    return "absent" if value is None else f"default {json.dumps(value)}"


def scenario_keys() -> str:
    """Returns the list of all keys of a scenario file."""
    rows = keys_of_scenarios()
    width = max(len(row["key"]) for row in rows)
    lines = [f"{row['key']:<{width}}  {row['type']}; {row['default']}; {row['meaning']}" for row in rows]
    return "\n".join(["```text", *lines, "```"])


def catalogue() -> str:
    """Returns the table of the scenarios that come with flockscope."""
    resolve = import_module("scenarios.loading.resolve")
    rows = []
    for name in resolve.names():
        scenario = resolve.load(name)
        orders = ", ".join(sorted({order.type for order in scenario.event})) or "–"
        rows.append(f"| `{name}` | {scenario.about} | {scenario.duration:g} | {orders} |")
    return table("scenario", "what happens, and whose claim it tests", "s", "orders", rows=rows)


def suites() -> str:
    """Returns the table of the suites that come with flockscope."""
    resolve = import_module("scenarios.loading.resolve")
    rows = [
        f"| `{name}` | {len(resolve.resolve(f'suite:{name}'))} | {resolve.read_suite(resolve.suite_file(name)).about} |"
        for name in resolve.suite_names()
    ]
    return table("suite", "entries", "what it is", rows=rows)


def scores() -> str:
    """Returns the table of all scores."""
    found = [s for s in import_module("tracking.scoring.catalogue").ALL if not s.key.endswith("_core")]
    rows = []
    for s in found:
        low, high = (f"{v:g}".replace("inf", "∞").replace("-", "−") for v in (s.low, s.high))
        cells = (f"`{s.key}`", s.unit.replace("|", "or"), f"{low} to {high}", s.better, s.meaning, s.source)
        rows.append(f"| {' | '.join(cells)} |")
    return table("key", "unit", "range", "better", "meaning", "source", rows=rows)


def observations() -> str:
    """Returns the table of the statistics that the environment observes."""
    rows = [
        f"| {k} | `{s.name}` | {'share' if s.half is None else f'{s.half:g} {s.unit}'.strip()} | {s.meaning} |"
        for k, s in enumerate(import_module("tracking.environment.observation").STATISTICS)
    ]
    return table("", "statistic", "0.5 stands for", "meaning", rows=rows)


def axes() -> str:
    """Returns the table of the axes of difficulty."""
    found = import_module("tracking.stress.axes").AXES.values()
    rows = [f"| `{axis.name}` | {axis.easy:g} | {axis.hard:g} | {axis.about} |" for axis in found]
    return table("axis", "easy", "hard", "value", rows=rows)


def parameters(config: str) -> str:
    """Returns the table of the parameters of a config class, MODULE:CLASS: default, presets, range, unit, meaning."""
    module, _, name = config.partition(":")
    kind = getattr(import_module(module), name)
    names = import_module("tracking.config").presets(kind.tracker)
    presets = {preset: kind.load(preset).as_dict() for preset in names}
    rows = []
    for p in kind.params().values():
        changed = [values[p.name] for values in presets.values()]
        span = ", ".join(f"`{c}`" for c in p.choices) if p.choices else f"{p.low:g} to {p.high:g}"
        span += " (log)" if p.scale == "log" else ""
        given = ["" if value == p.default else str(value) for value in changed]
        rows.append(f"| {' | '.join([f'`{p.name}`', str(p.default), *given, span, p.unit, _cell(p.meaning)])} |")
    named = (f"preset `{preset}`" for preset in presets)
    return table("parameter", "default", *named, "range", "unit", "meaning", rows=rows)


def constants(package: str) -> str:
    """Returns the constants of a tracker's package: numbers with an upper-case name and a comment behind or above."""
    rows = []
    for path in sorted((ROOT / "tracking" / "papers" / package).glob("*.py")):
        source = path.read_text(encoding="utf-8")
        found = _constants(ast.parse(source).body, source.splitlines())
        rows += [f"| {name} | {value:g} | `{path.stem}` | {_cell(meaning)} |" for name, value, meaning in found]
    return table("constant", "value", "module", "meaning", rows=rows)


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


def method(module: str) -> str:
    """Returns the docstring of a module without its first paragraph."""
    return inspect.cleandoc(import_module(module).__doc__ or "").partition("\n\n")[2]


def preset(name: str) -> str:
    """Returns the file of a preset, PRESET/TRACKER."""
    text = (ROOT / "tracking" / "presets" / f"{name}.toml").read_text(encoding="utf-8")
    return f"```toml\n{text}```"


def changelog() -> str:
    """Returns the CHANGELOG without its title."""
    return _of_the_root("CHANGELOG.md")


def contributing() -> str:
    """Returns CONTRIBUTING.md without its title."""
    return _of_the_root("CONTRIBUTING.md")


def _of_the_root(name: str) -> str:
    text = (ROOT / name).read_text(encoding="utf-8").partition("\n")[2]
    return text.replace("](docs/", "](/")


def table(*columns: str, rows: list[str]) -> str:
    """Returns a Markdown table."""
    return "\n".join([f"| {' | '.join(columns)} |", "|---" * len(columns) + "|", *rows])


PARTS: dict[str, Callable[..., str]] = {
    part.__name__.replace("_", "-"): part
    for part in (
        commands,
        scenario_keys,
        catalogue,
        suites,
        scores,
        observations,
        axes,
        parameters,
        constants,
        method,
        preset,
        changelog,
        contributing,
    )
}
GENERATED = re.compile(r"^<!-- generated: (\S+) ?(\S*) -->(?:\n\*`make docs` puts .*\*)?$", re.MULTILINE)
OUTSIDE = re.compile(r"\]\((?:\.\./)+(README|CONTRIBUTING|CHANGELOG)\.md")
PAGE_OF = {"README": "index.md", "CONTRIBUTING": "contributing.md", "CHANGELOG": "changelog.md"}
INTERVAL = re.compile(r"(?<=\d \[)([-+]?[\d.]+,) (?=[-+]?[\d.]+\])|(?<=\d\]) (?=\*)")
COMMANDS = re.compile(r"^```\n(?=(flockscope|python|pip|make) )", re.MULTILINE)
PAGES = re.compile(r"^<!-- pages (\w+): (.*) -->$", re.MULTILINE)


def with_generated_parts(text: str) -> str:
    """Returns the text of a page with all parts that are made from the code."""
    text = OUTSIDE.sub(lambda found: f"](/{PAGE_OF[found[1]]}", text)
    text = GENERATED.sub(lambda found: PARTS[found[1]](*filter(None, [found[2]])), text)
    text = COMMANDS.sub("```sh\n", INTERVAL.sub("\\1\N{NO-BREAK SPACE}", text))
    return PAGES.sub(lambda found: navigation(*found.groups()), text)


def navigation(title: str, pages: str) -> str:
    """Returns a table of contents that only the navigation shows."""
    return "\n".join(["```{toctree}", ":hidden:", f":caption: {title}", "", *pages.split(), "```"])


def undocumented() -> list[str]:
    """Returns the public names that no page documents."""
    text = "\n".join(page.read_text(encoding="utf-8") for page in ROOT.glob("docs/**/*.md"))
    names = [f"{package}.{name}" for package in PUBLIC for name in import_module(package).__all__]
    return [name for name in names if not re.search(rf"^\.\. auto\w+:: {re.escape(name)}$", text, re.MULTILINE)]


def options_as_list(_app: Any, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Makes a list of the lines `name=default: text` below a line `Options:`."""
    if "Options:" in lines:
        start = lines.index("Options:") + 1
        lines[start:] = [re.sub(r"^(\w+\S*): ", r"- ``\1``: ", line.replace("*", r"\*")) for line in lines[start:]]


def setup(app: Any) -> None:
    """Sphinx calls this."""
    if missing := undocumented():
        raise RuntimeError(f"docs/reference/python.md: no entry of {', '.join(missing)}")

    def read(_app: Any, _name: str, source: list[str]) -> None:
        source[0] = with_generated_parts(source[0])

    app.connect("source-read", read)
    app.connect("autodoc-process-docstring", options_as_list)
