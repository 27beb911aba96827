"""Who belongs together, by the rule, by the belief and by SPENCER's relations, from labelled people.

    python -m benchmarks.belief recordings [--data FOLDER]
    python -m benchmarks.belief suites [--scenes standard friends-meet …]
    python -m benchmarks.belief decisions [--scenes standard …] [--seeds 20000:20001] [--data FOLDER]
    python -m benchmarks.belief calibration [--scenes streets] [--seeds 20000:20001] [--out CHART.svg]
    python -m benchmarks.belief ablation [--seeds 30000:30002] [--check 20000:20002]

recordings: pairwise F1 on seq_hotel and zara01 from labelled positions, with intervals by blocks of frames; then from
positions that err by 0.1 m, with 5 % missed, mean over 10 draws. CAVIAR's Meet_WalkTogether1 at its own scale. SPENCER
(Linder et al. 2016) relates pairs of each frame by a linear model and takes connected components; it uses labelled
velocities.
suites: pairwise F1, group F1, event F1, merges that are wrong or missed, and seconds until a merge is reported; means
over sequences with 95 % intervals, and the paired difference.
decisions: pairwise F1 by SPENCER, by the groups of now, by those of events, which change late, and of pairs whose
probability is above 0.5; on two recordings, and in means over sequences, of `streets` by quarters of density, too.
calibration: probability and share of mates by bin, expected calibration error, all scenes weighing the same; --out:
the same as a reliability plot.
ablation: scores of fits to --seeds without each quantity, and of the default with other numbers, on --check seeds and
on the recordings.
--grouping FILE.toml: another belief.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from benchmarks.support.chart import Panel, lines
from benchmarks.support.options import HOTEL, WALK_TOGETHER, ZARA, add_data, add_seeds, new_parser, seed_range
from benchmarks.support.replaced_code import replaced_code
from benchmarks.support.tables import difference_cell, head, interval, mean_cell, number, row, signed, table
from scenarios.loading.resolve import resolve
from sim.types import Array, Bools, Ints, Truth
from tracking.fitting.belief import fit_belief, sample_of
from tracking.fitting.belief_scores import BINS, belief_scores, reliability
from tracking.fitting.grouping_scenes import DETECTED, MISSED, pair_scenes, simulated
from tracking.grouping import grouping_choice
from tracking.grouping.belief import Belief, pair_probabilities
from tracking.grouping.belief_groups import FoundGroups, belief_groups
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.grouping_choice import Grouping, grouping_of
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule
from tracking.grouping.pair_evidence import NAMES, NEAR, QUANTITIES, TIMES
from tracking.recordings.source import open_source
from tracking.scoring.evaluation import evaluate
from tracking.stats import block_intervals

# Scenes to which the default is fitted: for *now*, and for *events*.
TRAIN = (("streets", "streets", "standard"), ("standard", "friends-meet", "friends-meet-hard", "streets"))
KEYS = ("pairwise_F1", "group_F1_hull", "event_F1", "merge_latency")


def pairs_in_frames(truth: Truth) -> tuple[Ints, Ints, Bools]:
    """Returns the rows i, j of all pairs of people of one frame, and whether they are labelled as one group."""
    found = []
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        i, j = np.triu_indices(r.stop - r.start, 1)
        found.append((i + r.start, j + r.start))
    i, j = (np.concatenate(part) for part in zip(*found, strict=True))
    return i, j, (truth.group[i] >= 0) & (truth.group[i] == truth.group[j])


def linked_pairs(truth: Truth, rule: Grouping, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows the rule puts into one group."""
    derived = derive(people_as_tracks(truth), truth.fps, truth.px_per_m, rule)
    group = np.concatenate([t.group for t in derived])
    return (group[i] >= 0) & (group[i] == group[j])


def f1(weight: Array, frame: Ints, true: Bools, found: Bools) -> Array:
    """Returns the pairwise F1 of each row of weights (D, frames), (D,); rows of pairs: frame (from 0), true, found."""
    count = [np.bincount(frame[rows], minlength=weight.shape[1]) for rows in (true & found, true, found)]
    hits, positives, reported = (weight @ c for c in count)
    return np.asarray(2 * hits / np.maximum(positives + reported, 1e-9))


def spencer(truth: Truth, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows SPENCER's default relations put into one group: its linear model, as written out in
    the software (spencer_people_tracking), from labelled positions and velocities."""
    assert truth.pos is not None
    assert truth.vel is not None
    distance = np.hypot(*(truth.pos[i] - truth.pos[j]).T)
    speed = np.hypot(*truth.vel.T)
    heading = np.where(speed < 0.1, 0.0, np.arctan2(truth.vel[:, 1], truth.vel[:, 0]))
    turn = np.abs((heading[i] - heading[j] + np.pi) % (2 * np.pi) - np.pi)
    differ = np.abs(speed[i] - speed[j])
    strength = 1.553 * (3.038 - 1.875 * distance - 0.560 * differ - 0.913 * turn) + 0.0124
    linked = (strength > 0) & (distance <= 3.0) & (differ <= 1.0) & (turn <= np.pi / 4)
    rows = len(truth.frame)
    part = connected_components(coo_array((np.ones(linked.sum()), (i[linked], j[linked])), (rows, rows)))[1]
    return np.asarray(part[i] == part[j])


def rough(truth: Truth, seed: int) -> Truth:
    """Returns a truth whose positions err by 0.1 m, without velocities, and of which 5 % of the rows are missing."""
    assert truth.pos is not None
    r = np.random.default_rng(seed)
    kept = r.random(len(truth.frame)) >= MISSED
    rows = {name: getattr(truth, name)[kept] for name in ("frame", "id", "group", "visibility")}
    pos = (truth.pos + r.normal(0, DETECTED.sd, truth.pos.shape))[kept]
    return truth.replace(**rows, pos=pos, vel=None, box=None, truncation=None)


def recordings(data: Path, belief: Belief) -> None:
    head(["recording", "SPENCER", "rule", "belief", "belief minus rule", "belief minus SPENCER"])
    for folder in (HOTEL, ZARA):
        truth = _truth(data / folder)
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
    truth = _truth(data / WALK_TOGETHER)
    people, both = people_as_tracks(truth), (LinkRule(), belief)
    found = [evaluate(truth, derive(people, truth.fps, truth.px_per_m, g)) for g in both]
    rule, own = (float(x["pairwise_F1"]) for x in found)
    row([f"Meet_WalkTogether1, {truth.px_per_m:.1f} px/m", "–", number(rule), number(own), f"{own - rule:+.3f}", "–"])


def _truth(path: Path) -> Truth:
    truth = open_source(path, images=False)[0].truth
    assert truth is not None
    return truth


COLUMNS = ["pairwise F1", "group F1", "event F1", "merge reported after, s", "merges right, wrong, missed"]


def scores_of(name: str, seeds: range, groupings: Mapping[str, Grouping]) -> dict[str, tuple[Array, str]]:
    """Returns for each grouping the scores `KEYS` of each sequence of a suite, (S, 4), and its merges as text."""
    found: dict[str, list[list[float]]] = {key: [] for key in groupings}
    merges = {key: np.zeros(3) for key in groupings}
    for entry in resolve(name):
        for seed in seeds:
            truth = simulated(entry, seed)
            people = people_as_tracks(truth)
            for key, grouping in groupings.items():
                scores = evaluate(truth, derive(people, truth.fps, truth.px_per_m, grouping))
                found[key].append([scores[k] for k in KEYS])
                merges[key] += np.nan_to_num([scores[f"merge_{k}"] for k in ("TP", "FP", "FN")])
    return {key: (np.array(rows), ", ".join(f"{n:.0f}" for n in merges[key])) for key, rows in found.items()}


def suites(names: Sequence[str], seeds: range, belief: Belief) -> None:
    for name in names:
        found = scores_of(name, seeds, {"rule": LinkRule(), "belief": belief})
        cells = {key: [*map(mean_cell, values.T), text] for key, (values, text) in found.items()}
        cells["belief minus rule"] = [*map(difference_cell, (found["belief"][0] - found["rule"][0]).T), ""]
        title = f"{Path(name).stem}, seeds {seeds.start}:{seeds.stop}, {len(found['rule'][0])} sequences"
        table(title, "", COLUMNS, cells)


def late_groups(*rows: Any, **options: Any) -> FoundGroups:
    """Returns the groups of events in place of those of now."""
    return replace(belief_groups(*rows, **options), now=None)


def probable_pairs(truth: Truth, belief: Belief, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows are together with a probability above 0.5."""
    found = pair_probabilities(people_as_tracks(truth), truth.fps, truth.px_per_m, belief)
    told = found.probability > 0.5
    size = int(truth.id.max()) + 1
    low, high = np.sort([truth.id[i], truth.id[j]], axis=0)
    keys = (found.frame * size + found.a) * size + found.b
    return np.isin((truth.frame[i] * size + low) * size + high, keys[told])


def decision_scores(truth: Truth, belief: Belief) -> list[float]:
    """Returns the pairwise F1 of each decision of `DECIDED`, nan without mates."""
    i, j, same = pairs_in_frames(truth)
    with replaced_code([(grouping_choice, "belief_groups", late_groups)]):
        late = linked_pairs(truth, belief, i, j)
    found = (spencer(truth, i, j), linked_pairs(truth, belief, i, j), late, probable_pairs(truth, belief, i, j))
    once, frame = np.ones((1, truth.length)), truth.frame[i] - 1
    return [float(f1(once, frame, same, x)[0]) if same.any() else float("nan") for x in found]


DECIDED = ("SPENCER", "now", "groups of events", "probability above 0.5")


def decisions(names: Sequence[str], seeds: range, belief: Belief, data: Path) -> None:
    head(["", *DECIDED, "now minus above 0.5"])
    for folder in (HOTEL, ZARA):
        scores = decision_scores(_truth(data / folder), belief)
        row([Path(folder).name, *map(number, scores), f"{scores[1] - scores[3]:+.3f}"])
    for name in names:
        truths = [simulated(entry, seed) for entry in resolve(name) for seed in seeds]
        found = np.array([decision_scores(truth, belief) for truth in truths])
        rows = {f"{Path(name).stem}, {len(truths)} sequences": np.arange(len(truths))}
        if name == "streets":
            order = np.argsort([len(truth.frame) / truth.length for truth in truths])
            rows |= {f"{name}, quarter {k} by people in view": q for k, q in enumerate(np.array_split(order, 4), 1)}
        for title, chosen in rows.items():
            scores = found[chosen][np.isfinite(found[chosen, 0])]
            row([title, *map(mean_cell, scores.T), difference_cell(scores[:, 1] - scores[:, 3])])


def calibration(names: Sequence[str], seeds: range, belief: Belief, out: Path | None) -> None:
    panels = []
    for name in names:
        sample = sample_of(list(pair_scenes([name], seeds)))
        log_odds = belief.log_odds(sample.values)[:, 0]
        scores, bins = belief_scores(sample, log_odds), reliability(log_odds, sample.together, sample.weight)
        words = [f"{key} {value:.0f}" if key == "pairs" else f"{key} {value:.3f}" for key, value in scores.items()]
        print(f"\n{Path(name).stem}: {', '.join(words)}")
        head(["probability", "share of rows", "mean probability", "share of mates"])
        for k, (share, mean, mates) in enumerate(bins):
            row([f"{k / BINS:.2f}–{(k + 1) / BINS:.2f}", number(share, 4), number(mean), number(mates)])
        known = bins[bins[:, 0] > 0]
        curves = {"belief": known[:, 2], "as it should be": known[:, 1]}
        title = f"{Path(name).stem}: calibration error {scores['calibration error']:.3f}"
        panels.append(Panel(title, known[:, 1].tolist(), curves, "probability", "share of mates", (0.0, 1.0)))
    if out is not None:
        lines(panels, out)


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
    truths = [_truth(data / folder) for folder in (HOTEL, ZARA)]
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
                 *(number(_f1(truth, grouping)) for truth in truths)]
            )  # fmt: skip


def _f1(truth: Truth, grouping: Grouping) -> float:
    i, j, same = pairs_in_frames(truth)
    return float(f1(np.ones((1, truth.length)), truth.frame[i] - 1, same, linked_pairs(truth, grouping, i, j))[0])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["recordings", "suites", "decisions", "calibration", "ablation"])
    parser.add_argument("--scenes", nargs="+", metavar="NAME", help="scenarios, suites or *.toml files")
    parser.add_argument("--grouping", default="belief", metavar="FILE.toml", help="another belief")
    add_seeds(parser, "20000:20001")
    parser.add_argument("--check", type=seed_range, default="20000:20002", metavar="A:B", help="ablation: test seeds")
    parser.add_argument("--out", type=Path, metavar="CHART.svg", help="calibration: reliability plot")
    add_data(parser)
    args = parser.parse_args()
    belief = grouping_of(args.grouping)
    assert isinstance(belief, Belief), "--grouping names a belief"
    _run(args, belief)


def _run(args: argparse.Namespace, belief: Belief) -> None:
    if args.mode == "recordings":
        recordings(args.data, belief)
    elif args.mode == "suites":
        suites(args.scenes or ["standard", "friends-meet"], args.seeds, belief)
    elif args.mode == "decisions":
        decisions(args.scenes or ["standard", "friends-meet", "streets"], args.seeds, belief, args.data)
    elif args.mode == "calibration":
        calibration(args.scenes or ["standard"], args.seeds, belief, args.out)
    else:
        ablation(args.seeds, args.check, args.data)


if __name__ == "__main__":
    main()
