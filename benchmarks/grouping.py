"""The baseline grouping rule and the event rules on real people, from true positions.

    python -m benchmarks.grouping recordings [--data FOLDER]
    python -m benchmarks.grouping choose [--seeds 0:4]

recordings, seq_hotel: pairwise F1, precision and recall of membership (pairs of labelled people of a frame, pooled over
frames). Compared: two rules that judge each frame alone (the second has the best of nine settings, chosen on this very
recording), the baseline rule (tracking/grouping/link_rule.py), and variants of it; `wrong pairs` are those that the
rule links and the labels do not, by whether both people stand. No variant is chosen on this recording: CHOSEN is
the best of the six settings of `choose` on simulated crowds, but the two parameters that these vary were picked with
this recording's errors in view. Most of the wrong pairs are people who wait: by position and velocity alone they are as
near and as alike as people who talk.
Meet_WalkTogether1: the longest time for which the merge rule holds between people labelled as one group, events by the
event rules, and events that the baseline rule reports. PETS09-S2L1: in how many frames the two people who walk together
(11 and 12) are in one group.
choose: pairwise F1 of six settings on the catalogue, training seeds: one column per setting, the mean below.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.support.options import HOTEL, PETS, WALK_TOGETHER, add_data, add_seeds, new_parser
from scenarios.loading.resolve import load, names
from sim.io.formats.caviar import CHORD
from sim.io.formats.group_labels import rows_to_grid
from sim.io.formats.velocity import differentiate
from sim.io.source import open_source
from sim.sequence import simulate
from sim.truth.merge_split_events import groups_and_events
from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY
from sim.truth.queue_detection import WAITING_SPEED
from sim.types import Truth
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule

CHOSEN = LinkRule(near=1.0, idle=0.4)  # the best setting of mode `choose` with seeds 0:4
RULES = {
    "baseline, seen for 2 s": LinkRule(acquaintance=2.0),
    "baseline (1 s)": LinkRule(),
    "baseline, idle = 0.4": LinkRule(idle=0.4),
    "baseline, near = 1 m": LinkRule(near=1.0),
    "both: CHOSEN": CHOSEN,
}
GRID = [LinkRule(near=near, idle=idle) for near in (1.0, 1.2, 1.5) for idle in (0.0, 0.4)]
SINGLE_FRAME = [(d, v) for d in (0.9, 1.2, 1.5) for v in (0.3, 0.5, 0.7)]  # greatest distance, m, and difference, m/s
PAIR = (11, 12)  # of PETS09-S2L1


def pairs_in_frames(truth: Truth) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns the rows i, j of all pairs of people of one frame, and whether they are labelled as one group."""
    found = []
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        i, j = np.triu_indices(r.stop - r.start, 1)
        found.append((i + r.start, j + r.start))
    i, j = (np.concatenate(part) for part in zip(*found, strict=True))
    return i, j, (truth.group[i] >= 0) & (truth.group[i] == truth.group[j])


def pairwise_f1(true: np.ndarray, found: np.ndarray) -> float:
    return float(2 * (true & found).sum() / max(true.sum() + found.sum(), 1))


def scores(true: np.ndarray, found: np.ndarray) -> str:
    hit, f1 = (true & found).sum(), pairwise_f1(true, found)
    return f"F1 {f1:.3f}   precision {hit / found.sum():.3f}   recall {hit / true.sum():.3f}"


def linked_pairs(truth: Truth, rule: Grouping, i: np.ndarray, j: np.ndarray) -> tuple[np.ndarray, dict[str, int]]:
    """Returns which pairs of rows the rule puts into one group, and how many events of each kind it reports."""
    derived = derive(people_as_tracks(truth), truth.fps, truth.px_per_m, rule)
    group = np.concatenate([t.group for t in derived])
    return (group[i] >= 0) & (group[i] == group[j]), Counter(e.kind for t in derived for e in t.events)


def hotel(data: Path) -> None:
    truth = open_source(data / HOTEL)[0].truth
    i, j, same = pairs_in_frames(truth)
    distance, difference = (np.hypot(*(x[i] - x[j]).T) for x in (truth.pos, truth.vel))
    print(f"seq_hotel, {len(same)} pairs, {same.sum()} in one group")
    d, v = max(SINGLE_FRAME, key=lambda g: pairwise_f1(same, (distance < g[0]) & (difference < g[1])))
    print(f"  {'each frame alone, 1.5 m':24} {scores(same, (distance < 1.5) & (difference < 0.5))}")
    print(f"  {f'… best of nine: {d} {v}':24} {scores(same, (distance < d) & (difference < v))}")
    speed = np.hypot(*truth.vel.T)
    stand = np.maximum(speed[i], speed[j]) < WAITING_SPEED
    for name, rule in RULES.items():
        found, events = linked_pairs(truth, rule, i, j)
        wrong = f"wrong pairs: {(found & ~same & stand).sum()} stand, {(found & ~same & ~stand).sum()} walk"
        print(f"  {name:24} {scores(same, found)}   {wrong}   {dict(events)}")


def longest_merge(truth: Truth, centre: np.ndarray, vel: np.ndarray, a: int, b: int) -> float:
    """Returns the longest time, s, for which the merge rule holds between two people labelled as one group.

    centre (N, 2), px, and vel (N, 2), px/s: of all rows of the truth.
    """
    at = [{int(f): k for k, f in enumerate(truth.frame) if truth.id[k] == p} for p in (a, b)]
    longest = now = 0
    for frame in sorted(at[0].keys() & at[1].keys()):
        i, j = at[0][frame], at[1][frame]
        distance, difference = (np.hypot(*(x[i] - x[j])) / truth.px_per_m for x in (centre, vel))
        one = truth.group[i] >= 0 and truth.group[i] == truth.group[j]
        now = now + 1 if one and distance < MERGE_DISTANCE and difference < MERGE_VELOCITY else 0
        longest = max(longest, now)
    return longest / truth.fps


def caviar(data: Path) -> None:
    truth = open_source(data / WALK_TOGETHER)[0].truth
    print(f"Meet_WalkTogether1, {truth.px_per_m:.1f} px/m")
    for g in np.unique(truth.group[truth.group >= 0]):
        rows = truth.group == g
        people, frames = np.unique(truth.id[rows]).tolist(), truth.frame[rows]
        print(f"  labelled: people {people}, frames {frames.min()}-{frames.max()}")
    centre = truth.box[:, :2] + truth.box[:, 2:] / 2
    chords = differentiate(truth.frame, truth.id, centre, truth.fps, CHORD)
    for a, b in ((1, 2), (5, 6), (3, 4)):
        print(f"  {a} and {b}: the merge rule holds for {longest_merge(truth, centre, chords, a, b):.1f} s at most")
    for window in (0.5, 1.0, 2.0):
        print(f"  event rules, velocities over {window} s: {events_by_rules(truth, centre, window)}")
    for name, rule in (("default", LinkRule()), ("velocities over 1 s", LinkRule(smooth=1.0))):
        derived = derive(people_as_tracks(truth), truth.fps, truth.px_per_m, rule)
        events = [(e.kind, e.start, e.emitted, e.members) for t in derived for e in t.events]
        print(f"  baseline rule, {name}: (kind, start, reported, members) {events}")


def events_by_rules(truth: Truth, centre: np.ndarray, window: float) -> list[tuple[str, int, list[int]]]:
    """Returns kind, first frame and people of each event that the event rules measure on the labels.

    centre (N, 2): centres of the boxes, px; window: s over which velocities are differences.
    """
    vel = differentiate(truth.frame, truth.id, centre, truth.fps, window)
    label = np.where(truth.group >= 0, truth.group, 1000 + truth.id)
    pos, speed, intent = (
        rows_to_grid(truth.frame, truth.id, x, truth.length)
        for x in (centre / truth.px_per_m, vel / truth.px_per_m, label.astype(float))
    )
    present, people = np.isfinite(intent), np.unique(truth.id)
    groups = np.where(present, intent, -1).astype(np.int64)
    found = groups_and_events(pos, speed, present, groups, truth.fps).events
    return [(e.kind, e.start, [int(people[m - 1]) for m in e.members]) for e in found]


def pets(data: Path) -> None:
    truth = open_source(data / PETS, images=False)[0].truth
    derived = derive(people_as_tracks(truth), truth.fps, truth.px_per_m)
    both = [t for t in derived if set(PAIR) <= set(t.id.tolist())]
    a, b = ([t.group[t.id == person].item() for t in both] for person in PAIR)
    one = [t.index for t, g, h in zip(both, a, b, strict=True) if g >= 0 and g == h]
    print(f"PETS09-S2L1: 11 and 12 are seen together in {len(both)} frames", end=", ")
    print(f"a group in {len(one)}, from {one[0]} to {one[-1]}")
    print("  ", [(e.kind, e.start, e.emitted, e.members) for t in derived for e in t.events])


def choose(seeds: range) -> None:
    found: dict[str, list[float]] = {}
    for name in names():
        truths = [simulate(load(name), seed, streams=()).truth for seed in seeds]
        pairs = [pairs_in_frames(truth) for truth in truths]
        same = np.concatenate([s for _, _, s in pairs])
        found[name] = []
        for rule in GRID:
            linked = [linked_pairs(truth, rule, i, j)[0] for truth, (i, j, _) in zip(truths, pairs, strict=True)]
            found[name].append(pairwise_f1(same, np.concatenate(linked)))
        print(f"  {name:18}", *(f"{x:9.3f}" for x in found[name]), flush=True)
    print(f"  {'near / idle':18}", *(f"{r.near:4} /{r.idle:3}" for r in GRID))
    means = np.mean(list(found.values()), axis=0)
    print(f"  {'mean':18}", *(f"{x:9.3f}" for x in means), f"  best: {GRID[int(means.argmax())]}")


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["recordings", "choose"])
    add_seeds(parser, "0:4", what="choose: training seeds, ")
    add_data(parser)
    args = parser.parse_args()
    if args.mode == "choose":
        choose(args.seeds)
        return
    for recording in (hotel, caviar, pets):
        recording(args.data)


if __name__ == "__main__":
    main()
