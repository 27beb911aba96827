"""`flockscope scenarios`: lists scenarios and suites, or explains one in words."""

from __future__ import annotations

from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading.resolve import dump, load, names, read_suite, resolve, suite_file, suite_names
from scenarios.loading.toml_files import SUITES
from tracking.app.command_options import ScenariosOptions
from tracking.app.command_result import CommandResult
from tracking.app.option_parsing import scenario_settings


def scenarios(options: ScenariosOptions) -> CommandResult:
    """Explains the named scenario or suite; without a name lists all."""
    if options.name is not None:
        return explain(options.name, options.settings, options.out)
    for option, value in {"--out": options.out, "--set": options.settings}.items():
        if value:
            got, remedy = f"{option} without a scenario to explain", "name a scenario"
            raise InputError(place=option, got=got, expected="NAME", remedy=remedy)
    return catalogue()


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
    from sim.store.atomic import write_file
    from sim.store.own_files import output_file

    write_file(output_file(drawing, ".svg"), svg(scenario).encode())
    return CommandResult({**data, "drawing": drawing}, f"{words}\n{drawing}")


def _rows(about: dict[str, str]) -> list[str]:
    width = max(map(len, about), default=0)
    return [f"  {name:<{width}}  {words}".rstrip() for name, words in about.items()] or ["  none"]
