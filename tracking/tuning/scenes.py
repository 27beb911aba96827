"""Which scenes a search may use for what: seeds of ranges that never meet, suites that share nothing, no recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading import suites as suite
from scenarios.loading import toml_files
from sim.dataset.splits import SPLITS, split_of
from tracking.environment.episodes import Source, sources

Scenes = str | Path | Sequence[str | Path]
"""A suite, a scenario, a TOML file, or a list of these."""

EPISODES = {"train": 16, "val": 48, "test": 100}
"""How many episodes default seeds make, at least."""

LEAST = 2
"""Seeds of each scene, at least, where nothing is said."""

OPTION = {"train": "--seeds", "val": "--validation", "test": "--test"}
WORD = {"train": "training", "val": "validation", "test": "test"}
UNUSED = ("friends-meet", "crossing")
"""Suites to check on: the first that shares no scenario with what was tuned on."""


def named(suite: Scenes) -> tuple[str, ...]:
    """One name or several as several."""
    return (str(suite),) if isinstance(suite, str | Path) else tuple(map(str, suite))


def chosen_seeds(seeds: range | None, split: str, scenes: int) -> range:
    """The seeds, if all are of the split; where nothing is said the split's first, enough for EPISODES."""
    low, high = next((low, high) for name, low, high in SPLITS if name == split)
    if seeds is None:
        return range(low, low + max(LEAST, -(-EPISODES[split] // scenes)))
    if not isinstance(seeds, range):
        got, remedy = repr(seeds), f"write for example range({low}, {low + 4})"
        raise InputError(place=OPTION[split], got=got, expected="a range of seeds", remedy=remedy)
    try:
        good = split_of(seeds) == split
    except InputError:
        good = False
    if not good:
        raise InputError(
            place=OPTION[split], got=f"{seeds.start}:{seeds.stop}",
            expected=f"{WORD[split]} seeds, out of {low}:{high}",
            remedy=f"write for example {low}:{low + 4}: training, validation and test are kept apart",
        )  # fmt: skip
    return seeds


def scenes(names: Sequence[str], settings: Sequence[str], option: str) -> int:
    """How many scenes these suites, scenarios or files make; InputError for a recording, and where there is nothing."""
    for name in names:
        if not name.endswith(".toml") and not _known(name) and Path(name).exists():
            raise InputError(
                file=name, place=option, got="a recording or stored data",
                expected="scenes to simulate: nothing is tuned on what was recorded",
                remedy="give a suite or scenario; `flockscope fit sensor` lets it err like a recording's detector",
            )  # fmt: skip
    try:
        return len(sources(list(names), (0,), tuple(settings)))
    except InputError as error:
        raise error if error.place else InputError(**{**error.as_dict(), "place": option}) from None


def of(names: Sequence[str], seeds: range, settings: Sequence[str]) -> tuple[Source, ...]:
    """Every scene with every seed."""
    return sources(list(names), seeds, tuple(settings))


def unused(names: Sequence[str]) -> str | None:
    """A suite that shares no scenario with these, None if there is none."""
    return next((suite for suite in UNUSED if not shared(names, (suite,))), None)


def shared(names: Sequence[str], others: Sequence[str]) -> list[str]:
    """Scenarios that both are made of, sorted."""
    common = {file for name in names for file in _files(name)} & {file for name in others for file in _files(name)}
    return sorted(Path(file).stem for file in common)


def _files(name: str) -> list[str]:
    """The files of the scenarios that a scenario's, a suite's or a file's name stands for."""
    bare = name.removeprefix("suite:")
    if bare != name or (bare in toml_files.suite_names() and bare not in toml_files.names()) or _is_suite(bare):
        path = suite.find_suite(bare)
        return [str(toml_files.find(line.scenario, beside=path.parent).resolve()) for line in suite.read_entries(path)]
    return [str(toml_files.find(bare).resolve())]


def _is_suite(name: str) -> bool:
    return name.endswith(".toml") and "entry" in toml_files.parse(toml_files.find(name))


def _known(name: str) -> bool:
    return name.startswith("suite:") or name in (*toml_files.names(), *toml_files.suite_names())
