"""The rules of groups on real people: what the baseline rule and the event rules find from true positions.

    python benchmarks/real_groups.py [--data FOLDER]        (or $FLOCKSCOPE_DATA; see docs/formats.md for what it holds)

seq_hotel: pairwise membership F1 (pairs of labelled people of a frame, pooled over frames), baseline rule against rules
that judge each frame alone. Parameters besides the defaults are shown for what they do, not to be chosen here.
Meet_WalkTogether1: when labelled groups come together by the event rules, and what the baseline rule says.
PETS09-S2L1: the pair that walks together, persons 11 and 12.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import numpy as np

from sim.groups import memberships
from sim.io.labels import dense
from sim.io.source import open_source
from sim.io.velocity import differentiate
from sim.types import Tracks, Truth
from tracking.grouping import Grouping, derive

RULES = {
    "contract, 2 s seen": Grouping(acquaintance=2.0),
    "default (1 s seen)": Grouping(),
    "velocities over 0.8 s": Grouping(smooth=0.8),
    "velocities over 2 s": Grouping(smooth=2.0),
    "parts by velocity, too": Grouping(diverge=0.7),
    "standing links nobody": Grouping(idle=0.4),
    "… and near = 1.1 m": Grouping(idle=0.4, near=1.1),
}


def as_tracks(truth: Truth) -> list[Tracks]:
    """The true people as somebody's tracks, without groups; velocities only where the recording has them."""
    made = []
    plane = "image" if truth.pos is None else "ground"
    for index in range(1, truth.length + 1):
        here = truth.at(index)
        n = len(here.id)
        pos = here.pos if here.pos is not None else here.box[:, :2] + here.box[:, 2:] / 2
        vel = here.vel if here.vel is not None else np.full((n, 2), np.nan)
        alone = np.full(n, -1)
        made.append(
            Tracks(index, here.t, plane, "person", here.id, alone, pos, vel, np.zeros((n, 4, 4)), here.box, np.ones(n))
        )
    return made


def pairs(truth: Truth) -> tuple[np.ndarray, ...]:
    """All pairs of rows of one frame, and whether each is labelled as one group."""
    found = []
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        i, j = np.triu_indices(r.stop - r.start, 1)
        found.append((i + r.start, j + r.start))
    i, j = (np.concatenate(part) for part in zip(*found, strict=True))
    return i, j, (truth.group[i] >= 0) & (truth.group[i] == truth.group[j])


def scores(true: np.ndarray, said: np.ndarray) -> str:
    hit, wrong, missed = (true & said).sum(), (said & ~true).sum(), (true & ~said).sum()
    f1 = 2 * hit / (2 * hit + wrong + missed)
    return f"F1 {f1:.3f}   precision {hit / (hit + wrong):.3f}   recall {hit / (hit + missed):.3f}"


def hotel(root: Path) -> None:
    truth = open_source(root / "biwi" / "seq_hotel")[0].truth
    i, j, same = pairs(truth)
    gap, differ = (np.hypot(*(x[i] - x[j]).T) for x in (truth.pos, truth.vel))
    print(f"seq_hotel, {len(same)} pairs, {same.sum()} in one group")
    grid = [(d, v) for d in (1.0, 1.2, 1.5) for v in (0.3, 0.5, 0.7)]
    d, v = max(
        grid,
        key=lambda g: (
            2 * (same & (gap < g[0]) & (differ < g[1])).sum() / (same.sum() + ((gap < g[0]) & (differ < g[1])).sum())
        ),
    )
    print(f"  {'each frame alone, 1.5 m':24} {scores(same, (gap < 1.5) & (differ < 0.5))}")
    print(f"  {f'… best of nine, {d} m':24} {scores(same, (gap < d) & (differ < v))}")
    given = as_tracks(truth)
    for name, rule in RULES.items():
        start = time.perf_counter()
        made = derive(given, truth.fps, rule=rule)
        took = time.perf_counter() - start
        group = np.concatenate([t.group for t in made])
        kinds = [e.kind for t in made for e in t.events]
        told = {k: kinds.count(k) for k in ("merge", "form", "split", "dissolve", "cross", "queue")}
        print(f"  {name:24} {scores(same, (group[i] >= 0) & (group[i] == group[j]))}   {took:.2f} s   {told}")


def caviar(root: Path) -> None:
    truth = open_source(root / "caviar" / "mwt1gt.xml")[0].truth
    print(f"Meet_WalkTogether1, {truth.px_per_m:.1f} px/m")
    for g in np.unique(truth.group[truth.group >= 0]):
        rows = truth.group == g
        who, frames = np.unique(truth.id[rows]).tolist(), truth.frame[rows]
        print(f"  labelled: people {who}, frames {frames.min()}-{frames.max()}")
    centre = truth.box[:, :2] + truth.box[:, 2:] / 2
    people = np.unique(truth.id)
    label = np.where(truth.group >= 0, truth.group, 1000 + truth.id)
    for window in (0.5, 1.0, 2.0):
        vel = differentiate(truth.frame, truth.id, centre, truth.fps, window)
        pos, speed, intent = (
            dense(truth.frame, truth.id, x, truth.length)
            for x in (centre / truth.px_per_m, vel / truth.px_per_m, label.astype(float))
        )
        there = np.isfinite(intent)
        found = memberships(pos, speed, there, np.where(there, intent, -1).astype(np.int64), truth.fps).events
        told = [(e.kind, e.start, [int(people[m - 1]) for m in e.members]) for e in found]
        print(f"  event rules, velocities over {window} s: {told}")
    for name, rule in (("default", Grouping()), ("velocities over 1 s", Grouping(smooth=1.0))):
        told = [
            (e.kind, e.start, e.emitted, e.members)
            for t in derive(as_tracks(truth), truth.fps, truth.px_per_m, rule)
            for e in t.events
        ]
        print(f"  baseline rule, {name}: (kind, start, told, members) {told}")


def pets(root: Path) -> None:
    truth = open_source(root / "mot" / "PETS09-S2L1-first200")[0].truth
    made = derive(as_tracks(truth), truth.fps, truth.px_per_m)
    both = [t for t in made if {11, 12} <= set(t.id.tolist())]
    one = [t.index for t in both if t.group[t.id == 11] >= 0 and t.group[t.id == 11] == t.group[t.id == 12]]
    seen = f"11 and 12 are seen together in {len(both)} frames"
    print(f"PETS09-S2L1: {seen}, a group in {len(one)}, from {one[0]} to {one[-1]}")
    print("  ", [(e.kind, e.start, e.emitted, e.members) for t in made for e in t.events])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    beside = Path(__file__).resolve().parents[2] / "shared" / "data"
    parser.add_argument("--data", type=Path, default=Path(os.environ.get("FLOCKSCOPE_DATA", beside)))
    root = parser.parse_args().data
    for part in (hotel, caviar, pets):
        part(root)


if __name__ == "__main__":
    main()
