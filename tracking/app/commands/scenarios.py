"""`flockscope scenarios`: lists scenarios and suites, or explains one in words with a drawing of its script."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from scenarios.loading import suites as suite
from scenarios.loading import toml_files
from scenarios.loading.resolve import Entry, dump, load, names, resolve, suite_names
from tracking.app.command_options import ScenariosOptions
from tracking.app.command_result import CommandResult
from tracking.app.option_parsing import output_file, scenario_settings

if TYPE_CHECKING:
    from scenarios.schema.scenario import Scenario


def scenarios(options: ScenariosOptions) -> CommandResult:
    """Explains the named scenario or suite; without a name lists all, or with --schema the keys of a scenario file."""
    if options.name is not None and not options.schema:
        return explain(options.name, options.settings, options.out)
    unused = {"NAME": options.name, "--out": options.out, "--set": options.settings}
    for option, value in unused.items():
        if value:
            got, remedy = f"{option} without a scenario to explain", "name a scenario, and leave --schema out"
            raise InputError(place=option, got=got, expected="NAME", remedy=remedy)
    if options.schema:
        from tracking.app.commands.scenario_keys import list_keys

        return list_keys()
    return catalogue()


def catalogue() -> CommandResult:
    """Returns every scenario and suite of the catalogue with its line of description, sorted by name."""
    scenarios = {name: load(name).about for name in names()}
    suites = {name: suite.about(suite.find_suite(name)) for name in suite_names()}
    text = ["Scenarios", *_rows(scenarios), "", "Suites", *_rows(suites)]
    return CommandResult({"scenarios": scenarios, "suites": suites}, "\n".join(text))


def explain(name: str, settings: list[str], drawing: Path | None) -> CommandResult:
    """Returns a scenario in words with its plan, which it writes to `drawing` (SVG), or a suite's entries."""
    entries = resolve(name, scenario_settings(settings))
    if not _is_suite(name):
        return _explain_scenario(entries[0].scenario, drawing)
    if drawing is not None:
        raise InputError(
            place="--out", got=f"the suite {name}", expected="one scenario", remedy="name one of its entries"
        )
    return _list_entries(name, entries)


def _is_suite(name: str) -> bool:
    if name.endswith(".toml"):
        return not name.startswith("suite:") and "entry" in toml_files.parse(toml_files.find(name))
    return name.startswith("suite:") or name not in names()


def _explain_scenario(scenario: Scenario, drawing: Path | None) -> CommandResult:
    from scenarios.drawing.plan_svg import svg
    from scenarios.drawing.words import text

    words = text(scenario)
    data = {"name": scenario.name, "about": scenario.about, "text": words, "toml": dump(scenario)}
    if drawing is None:
        return CommandResult(data, words)
    from sim.io.files.atomic import write_file

    write_file(output_file(drawing, ".svg"), svg(scenario).encode())
    return CommandResult({**data, "drawing": drawing}, f"{words}\n{drawing}")


def _list_entries(name: str, entries: list[Entry]) -> CommandResult:
    rows = {entry.name: entry.scenario.about for entry in entries}
    return CommandResult({"name": name, "entries": rows}, "\n".join([f"{name}: {len(rows)} entries", *_rows(rows)]))


def _rows(about: dict[str, str]) -> list[str]:
    width = max(map(len, about), default=0)
    return [f"  {name:<{width}}  {words}".rstrip() for name, words in about.items()] or ["  none"]
