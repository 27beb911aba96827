"""`flockscope scenarios`: what there is, one of them in words with a drawing of its script."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from scenarios.loading import suites as suite
from scenarios.loading import toml_files
from scenarios.loading.resolve import Entry, dump, load, names, resolve, suite_names
from tracking.app.command_result import CommandResult
from tracking.app.option_parsing import named, scenario_settings

if TYPE_CHECKING:
    from scenarios.schema.scenario import Scenario


def catalogue() -> CommandResult:
    """Every scenario and suite, each with its line about itself."""
    scenarios = {name: load(name).about for name in names()}
    suites = {name: suite.about(suite.find_suite(name)) for name in suite_names()}
    text = ["Scenarios", *_rows(scenarios), "", "Suites", *_rows(suites)]
    return CommandResult({"scenarios": scenarios, "suites": suites}, "\n".join(text))


def explain(name: str, settings: Iterable[str] = (), drawing: Path | None = None) -> CommandResult:
    """One scenario in words with its plan, or the entries of a suite; `drawing`: where its SVG is written."""
    entries = resolve(name, scenario_settings(settings))
    if not _is_suite(name):
        return _one(entries[0].scenario, drawing)
    if drawing is not None:
        raise InputError(
            place="--out", got=f"the suite {name}", expected="one scenario", remedy="name one of its entries"
        )
    return _suite(name, entries)


def _is_suite(name: str) -> bool:
    if name.endswith(".toml"):
        return not name.startswith("suite:") and "entry" in toml_files.parse(toml_files.find(name))
    return name.startswith("suite:") or name not in names()


def _one(scenario: Scenario, drawing: Path | None) -> CommandResult:
    from scenarios.drawing import explain

    words = explain.text(scenario)
    data = {"name": scenario.name, "about": scenario.about, "text": words, "toml": dump(scenario)}
    if drawing is None:
        return CommandResult(data, words)
    from sim.io.files.atomic import write_file

    write_file(named(drawing, ".svg"), explain.svg(scenario).encode())
    return CommandResult({**data, "drawing": drawing}, f"{words}\n{drawing}")


def _suite(name: str, entries: list[Entry]) -> CommandResult:
    rows = {entry.name: entry.scenario.about for entry in entries}
    return CommandResult({"name": name, "entries": rows}, "\n".join([f"{name}: {len(rows)} entries", *_rows(rows)]))


def _rows(about: dict[str, str]) -> list[str]:
    wide = max(map(len, about), default=0)
    return [f"  {name:<{wide}}  {words}".rstrip() for name, words in about.items()] or ["  none"]
