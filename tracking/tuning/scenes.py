"""Which scenes a search may use for what.

Training, validation and test seeds come from ranges that do not overlap: 0:10000, 10000:20000 and 20000:30000. The
second test suite shares no scenario with the suite that is tuned on. Recordings are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading import suites, toml_files
from sim.dataset.splits import SPLITS, split_of
from tracking.environment.episodes import Source, sources
from tracking.tuning.options import Scenes

EPISODES = {"train": 16, "val": 48, "test": 100}  # Least number of episodes that the default seeds of each split make.

LEAST_SEEDS = 2  # Least number of default seeds of each scene.

OPTION = {"train": "--seeds", "val": "--validation", "test": "--test"}
WORD = {"train": "training", "val": "validation", "test": "test"}
CHECK_SUITES = ("friends-meet", "crossing")  # Candidates for the default of --check, in order of preference.


def suite_names(suite: Scenes) -> tuple[str, ...]:
    """Returns the names of suites, scenarios or files as texts, in the order given."""
    return (str(suite),) if isinstance(suite, str | Path) else tuple(map(str, suite))


def chosen_seeds(seeds: range | None, split: str, scenes: int) -> range:
    """Returns the seeds, or the default of the split if they are None."""
    low, high = next((low, high) for name, low, high in SPLITS if name == split)
    if seeds is None:
        return range(low, low + max(LEAST_SEEDS, -(-EPISODES[split] // scenes)))
    if not isinstance(seeds, range):
        got, remedy = repr(seeds), f"write for example range({low}, {low + 4})"
        raise InputError(place=OPTION[split], got=got, expected="a range of seeds", remedy=remedy)
    try:
        allowed = split_of(seeds) == split
    except InputError:
        allowed = False
    if not allowed:
        raise InputError(
            place=OPTION[split], got=f"{seeds.start}:{seeds.stop}",
            expected=f"{WORD[split]} seeds, out of {low}:{high}",
            remedy=f"write for example {low}:{low + 4}: training, validation and test are kept apart",
        )  # fmt: skip
    return seeds


def count_scenes(names: Sequence[str], settings: Sequence[str], option: str) -> int:
    """Returns the number of scenes that the suites, scenarios and files `names` contain, each counted with one seed."""
    for name in names:
        if not name.endswith(".toml") and not _is_known(name) and Path(name).exists():
            raise InputError(
                file=name, place=option, got="a recording or stored data",
                expected="scenes to simulate: nothing is tuned on what was recorded",
                remedy="give a suite or scenario; `flockscope fit sensor` imitates the detector of a recording",
            )  # fmt: skip
    try:
        return len(sources(list(names), (0,), tuple(settings)))
    except InputError as error:
        raise error if error.place else InputError(**{**error.as_dict(), "place": option}) from None


def episode_sources(names: Sequence[str], seeds: range, settings: Sequence[str]) -> tuple[Source, ...]:
    """Returns one source for every scene of the suites `names` with every seed."""
    return sources(list(names), seeds, tuple(settings))


def default_check_suite(names: Sequence[str]) -> str | None:
    """Returns the first of friends-meet and crossing that shares no scenario with `names`, None if there is none."""
    return next((suite for suite in CHECK_SUITES if not shared_scenarios(names, (suite,))), None)


def shared_scenarios(names: Sequence[str], others: Sequence[str]) -> list[str]:
    """Returns the names of the scenarios that both lists of suites, scenarios and files contain, sorted; [] if none."""
    common = {file for name in names for file in _files(name)} & {file for name in others for file in _files(name)}
    return sorted(Path(file).stem for file in common)


def _files(name: str) -> list[str]:
    bare = name.removeprefix("suite:")
    if bare != name or (bare in toml_files.suite_names() and bare not in toml_files.names()) or _is_suite(bare):
        path = suites.find_suite(bare)
        return [str(toml_files.find(line.scenario, beside=path.parent).resolve()) for line in suites.read_entries(path)]
    return [str(toml_files.find(bare).resolve())]


def _is_suite(name: str) -> bool:
    return name.endswith(".toml") and "entry" in toml_files.parse(toml_files.find(name))


def _is_known(name: str) -> bool:
    return name.startswith("suite:") or name in (*toml_files.names(), *toml_files.suite_names())
