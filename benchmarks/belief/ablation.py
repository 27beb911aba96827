"""Mode `ablation` of `benchmarks.belief`: scores of fits to --seeds without each quantity, and of the default with
other numbers, on --check seeds and on the recordings, also with errors of 0.15 m across and 0.6 m along the line of
sight. `lines`: false pairs for each person-minute.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.belief.errors import Errors, with_errors
from benchmarks.belief.pairs import labelled, pairwise_f1
from benchmarks.belief.queues import pair_scores
from benchmarks.belief.suites import scores_of
from benchmarks.support.options import HOTEL, ZARA
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, head, mean_cell, number, row
from scenarios.loading.resolve import resolve
from sim.types import Array, Truth
from tracking.fitting import belief as fit
from tracking.fitting import grouping_scenes
from tracking.fitting.belief import PairSample, fit_belief, sample_of
from tracking.fitting.grouping_scenes import pair_scenes, scenes_of, simulated
from tracking.grouping import mate_share, person_motion
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import grouping_of
from tracking.grouping.pair_evidence import NAMES, TIMES

# Scenes to which the default is fitted: for *now*, and for *events*.
TRAIN = (
    ("streets", "streets", "standard", "lines"),
    ("standard", "friends-meet", "friends-meet-hard", "streets", "lines"),
)
# Words of the names of tables that are left out together.
FAMILIES: Mapping[str, tuple[str, ...]] = {
    **{name: (name,) for name in dict.fromkeys(name.split(", ")[0] for name in NAMES)},
    **{f"means over {time:g} s": (f"{time:g} s",) for time in TIMES},
}
# Code that is replaced while the belief is fitted and scored.
PARTS: Mapping[str, Replacement] = {
    "tables for one level of noise": (fit, "LEVELS", (1e6, 2e6)),
    "noise of all people, not of each": (person_motion, "COMMON", 1e9),
    "the share of mates of the fit everywhere": (mate_share, "WEIGHT", 1e9),
    "scenes without errors alone": (grouping_scenes, "scenes_of", lambda *scene: scenes_of(*scene)[:1]),
}
CHANGED: Mapping[str, dict[str, float]] = {
    "`stay` = `come`": {"stay": 1.2},
    "`come` 0": {"come": 0.0},
    "`memory` 0 s": {"memory": 0.0},
    "`hold` = `join` = 0": {"hold": 0.0, "join": 0.0},
    "`nearest` 0": {"nearest": 0.0},
}
ERRORS = Errors(0.15, 0.6)
SUITES = ("standard", "friends-meet", "streets")
COLUMNS = (
    "standard, pairwise F1", "standard, event F1", "standard, merges right, wrong, missed", "friends-meet, pairwise F1",
    "streets, pairwise F1", "streets, merges right, wrong, missed", "lines, false", "seq_hotel", "zara01",
    "seq_hotel, 0.15/0.6 m", "zara01, 0.15/0.6 m",
)  # fmt: skip


def ablation(seeds: range, check: range, data: Path) -> None:
    default, samples = grouping_of("belief"), _samples(seeds)
    assert isinstance(default, Belief)
    cases = _Cases(check, data)
    head(["", *COLUMNS])
    base = cases.scores(fit_belief(*samples))
    _row("the same fit", base, None)
    for family, words in FAMILIES.items():
        used = [name for name in NAMES if not {*name.split(", ")} & {*words}]
        _row(f"no {family}", cases.scores(fit_belief(*samples, used)), base)
    for name, part in PARTS.items():
        with replaced_code([part]):
            _row(name, cases.scores(fit_belief(*_samples(seeds))), base)
    base = cases.scores(default)
    _row("default", base, None)
    for name, change in CHANGED.items():
        _row(name, cases.scores(replace(default, **change)), base)


def _samples(seeds: range) -> list[PairSample]:
    return [sample_of(list(pair_scenes(names, seeds))) for names in TRAIN]


@dataclass(frozen=True)
class _Scores:
    """Scores by suite (`scores_of`), false pairs of each sequence of `lines`, and F1 of recordings."""

    suites: Mapping[str, tuple[Array, str]]
    false: Array
    recordings: list[float]


class _Cases:
    """What every belief is scored on."""

    def __init__(self, check: range, data: Path) -> None:
        self.check = check
        exact = [labelled(data / folder) for folder in (HOTEL, ZARA)]
        self.recordings = [*exact, *(with_errors(truth, ERRORS, 0) for truth in exact)]
        self.lines: list[Truth] = [simulated(entry, seed) for entry in resolve("lines") for seed in check]

    def scores(self, belief: Belief) -> _Scores:
        suites = {name: scores_of(name, self.check, {"": belief})[""] for name in SUITES}
        false = np.array([pair_scores(truth, truth, belief)[0] for truth in self.lines])
        return _Scores(suites, false, [pairwise_f1(truth, belief) for truth in self.recordings])


def _row(name: str, found: _Scores, base: _Scores | None) -> None:
    write, minus = (mean_cell, 0.0) if base is None else (difference_cell, 1.0)
    base = base or found
    near, meet, far = ([*map(write, (found.suites[suite][0] - minus * base.suites[suite][0]).T)] for suite in SUITES)
    merges = {suite: found.suites[suite][1] for suite in SUITES}
    row(
        [name, near[0], near[2], merges["standard"], meet[0], far[0], merges["streets"],
         write(found.false - minus * base.false), *map(number, found.recordings)]
    )  # fmt: skip
