"""Mode `ablation` of `benchmarks.belief`: scores of fits to --seeds without each quantity, and of the default with
other numbers, on --check seeds and on the recordings.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from benchmarks.belief.pairs import labelled, pairwise_f1
from benchmarks.belief.suites import scores_of
from benchmarks.support.options import HOTEL, ZARA
from benchmarks.support.tables import difference_cell, head, mean_cell, number, row
from tracking.fitting.belief import fit_belief, sample_of
from tracking.fitting.grouping_scenes import pair_scenes
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import Grouping, grouping_of
from tracking.grouping.pair_evidence import NAMES, NEAR, QUANTITIES, TIMES

# Scenes to which the default is fitted: for *now*, and for *events*.
TRAIN = (("streets", "streets", "standard"), ("standard", "friends-meet", "friends-meet-hard", "streets"))
# Words of the names of tables that are left out together.
FAMILIES: Mapping[str, tuple[str, ...]] = {
    **{name: (name,) for name in (*QUANTITIES, *NEAR)},
    **{f"means over {time:g} s": (f"{time:g} s",) for time in TIMES},
}
CHANGED: Mapping[str, dict[str, float]] = {
    "`stay` = `come`": {"stay": 1.2},
    "`come` 0": {"come": 0.0},
    "`memory` 0 s": {"memory": 0.0},
}


def ablation(seeds: range, check: range, data: Path) -> None:
    default, samples = grouping_of("belief"), [sample_of(list(pair_scenes(names, seeds))) for names in TRAIN]
    assert isinstance(default, Belief)
    fits: dict[str, Grouping] = {}
    for family, words in {"the same fit": (), **FAMILIES}.items():
        used = [name for name in NAMES if not {*name.split(", ")} & {*words}]
        fits[f"no {family}" if words else family] = fit_belief(*samples, used)
    parts = (fits, {"default": default, **{name: replace(default, **change) for name, change in CHANGED.items()}})
    truths = [labelled(data / folder) for folder in (HOTEL, ZARA)]
    events = ["event F1", "merges right, wrong, missed"]
    head(["", *(f"standard, {word}" for word in ("pairwise F1", *events)), "friends-meet, pairwise F1",
          "streets, pairwise F1", f"streets, {events[1]}", "seq_hotel", "zara01"])  # fmt: skip
    for groupings in parts:
        suites = [scores_of(name, check, groupings) for name in ("standard", "friends-meet", "streets")]
        base = next(iter(groupings))
        for name, grouping in groupings.items():
            write, minus = (mean_cell, 0.0) if name == base else (difference_cell, 1.0)
            near, meet, far = ([*map(write, (found[name][0] - minus * found[base][0]).T)] for found in suites)
            row(
                [name, near[0], near[2], suites[0][name][1], meet[0], far[0], suites[2][name][1],
                 *(number(pairwise_f1(truth, grouping)) for truth in truths)]
            )  # fmt: skip
