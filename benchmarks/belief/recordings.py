"""Mode `recordings` of `benchmarks.belief`: pairwise F1 on labelled recordings.

seq_hotel and zara01 from labelled positions, with intervals by blocks of frames; then from positions that err by 0.1 m,
with 5 % missed, mean over 10 draws. CAVIAR's Meet_WalkTogether1 at its own scale. SPENCER uses labelled velocities.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.belief.pairs import f1, labelled, linked_pairs, pairs_in_frames, spencer
from benchmarks.support.options import HOTEL, WALK_TOGETHER, ZARA
from benchmarks.support.tables import head, interval, number, row, signed
from sim.types import Array, Bools, Ints, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule
from tracking.scoring.evaluation import evaluate
from tracking.stats import block_intervals

ERROR, MISSED = 0.1, 0.05  # m, share: of the rough positions


def rough(truth: Truth, seed: int) -> Truth:
    """Returns a truth whose positions err by 0.1 m, without velocities, and of which 5 % of the rows are missing."""
    assert truth.pos is not None
    r = np.random.default_rng(seed)
    kept = r.random(len(truth.frame)) >= MISSED
    rows = {name: getattr(truth, name)[kept] for name in ("frame", "id", "group", "visibility")}
    pos = (truth.pos + r.normal(0, ERROR, truth.pos.shape))[kept]
    return truth.replace(**rows, pos=pos, vel=None, box=None, truncation=None)


def recordings(data: Path, belief: Belief) -> None:
    head(["recording", "SPENCER", "rule", "belief", "belief minus rule", "belief minus SPENCER"])
    for folder in (HOTEL, ZARA):
        truth = labelled(data / folder)
        i, j, same = pairs_in_frames(truth)
        found = [spencer(truth, i, j), *(linked_pairs(truth, g, i, j) for g in (LinkRule(), belief))]
        frame = truth.frame[i] - 1

        def scores(weight: Array, found: list[Bools] = found, frame: Ints = frame, same: Bools = same) -> Array:
            other, rule, own = (f1(weight, frame, same, x) for x in found)
            return np.column_stack([other, rule, own, own - rule, own - other])

        ends = block_intervals(scores, truth.length, truth.fps, scales=("share",) * 3 + (None, None))  # type: ignore[arg-type]
        cells = [tuple(map(float, values)) for values in zip(*ends, strict=True)]
        row([Path(folder).name, *(interval(*x) for x in cells[:3]), *(signed(*x) for x in cells[3:])])
        draws = []
        for seed in range(10):
            erring = rough(truth, seed)
            i, j, same = pairs_in_frames(erring)
            frame = erring.frame[i] - 1
            once = np.ones((1, truth.length))
            draws.append([f1(once, frame, same, linked_pairs(erring, g, i, j))[0] for g in (LinkRule(), belief)])
        rule, own = np.mean(draws, axis=0)
        row([f"{Path(folder).name}, 0.1 m, 5 % missed", "–", number(rule), number(own), f"{own - rule:+.3f}", "–"])
    truth = labelled(data / WALK_TOGETHER)
    people, both = people_as_tracks(truth), (LinkRule(), belief)
    found = [evaluate(truth, derive(people, truth.fps, truth.px_per_m, g)) for g in both]
    rule, own = (float(x["pairwise_F1"]) for x in found)
    row([f"Meet_WalkTogether1, {truth.px_per_m:.1f} px/m", "–", number(rule), number(own), f"{own - rule:+.3f}", "–"])
