"""How long all scores take, groups among them: 1000 frames of 30 people in 10 groups, each with errors of all kinds,
as `track` gives them (what a tracker leaves empty has been derived).

    PYTHONPATH=. python benchmarks/group_scores.py [--frames 1000] [--people 30]

Best of several runs, in CPU time and by the clock, beside the scores of people alone on the same frames.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from sim.truth.group_hulls import groups_over_time
from sim.types import Groups, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring import evaluate

RUNS = 5
FPS = 10.0


def scene(frames: int, people: int) -> tuple[Truth, list[Tracks]]:
    """Groups of three that stroll over 20 m by 20 m, and tracks 0.2 m off, one in twenty in another's group."""
    r = np.random.default_rng(0)
    name = np.arange(people) // 3
    middle = r.uniform(0, 20, (people // 3 + 1, 2)) + np.cumsum(r.normal(0, 0.1, (frames, people // 3 + 1, 2)), axis=0)
    pos = (middle[:, name] + r.uniform(-0.6, 0.6, (people, 2))).reshape(-1, 2)
    frame, id = np.repeat(np.arange(1, frames + 1), people), np.tile(np.arange(1, people + 1), frames)
    group, vel = np.tile(name + 1, frames), np.zeros_like(pos)
    told = np.where(r.random(len(group)) < 0.05, r.integers(1, name[-1] + 2, len(group)), group)
    seen = pos + r.normal(0, 0.2, pos.shape)
    shapes = [tuple(groups_over_time(frame, id, g, p, vel, 1, frames)) for g, p in ((group, pos), (told, seen))]
    truth = Truth(
        "speed", FPS, frames, 40.0, frame, id, group, pos, vel, None, np.ones(len(id)), groups=shapes[0],
        labelled=np.ones(frames, bool), events=(),
    )  # fmt: skip
    zero, cov, one = np.zeros((people, 2)), np.zeros((people, 4, 4)), np.ones(people)
    rows = [slice(k * people, (k + 1) * people) for k in range(frames)]
    return truth, [
        Tracks(k, k / FPS, "ground", "person", id[r], told[r], seen[r], zero, cov, None, one, shapes[1][k - 1])
        for k, r in enumerate(rows, 1)
    ]


def groups_only(t: Tracks) -> Tracks:
    """The answer of a method that names no members."""
    g = t.groups
    assert g is not None
    n = len(g.id)
    none = tuple(np.zeros(0, np.int64) for _ in range(n))
    groups = Groups(g.id, none, g.pos, g.vel, g.extent, np.full(n, np.nan), g.hull)
    cov = np.zeros((n, 4, 4))
    return Tracks(t.index, t.t, t.plane, "group", g.id, g.id, g.pos, g.vel, cov, None, np.ones(n), groups)


def best(work: Callable[[], object]) -> tuple[float, float]:
    """Least CPU time and least time by the clock, s."""
    spent = []
    for _ in range(RUNS):
        cpu, clock = time.process_time(), time.perf_counter()
        work()
        spent.append((time.process_time() - cpu, time.perf_counter() - clock))
    cpu, clock = np.min(spent, axis=0)
    return float(cpu), float(clock)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--people", type=int, default=30)
    arguments = parser.parse_args()
    truth, tracks = scene(arguments.frames, arguments.people)
    made = with_groups(tracks, FPS, 1.0)
    unlabelled, bare = truth.replace(groups=None, labelled=None, events=None), [groups_only(t) for t in tracks]
    perfect = [t.replace(pos=truth.at(t.index).pos, groups=truth.at(t.index).groups) for t in tracks]
    cases: dict[str, Callable[[], object]] = {
        "people alone": lambda: evaluate(unlabelled, tracks),
        "all, groups by hulls": lambda: evaluate(truth, made),
        "all, groups by members": lambda: evaluate(truth, made, group_match="members"),
        "all, events derived as well": lambda: evaluate(truth, tracks),
        "all, hulls of the truth": lambda: evaluate(truth, perfect),
        "a method without members": lambda: evaluate(truth, bare),
    }
    print(f"{arguments.frames} frames, {arguments.people} people{'CPU s':>18}{'clock s':>9}")
    for name, work in cases.items():
        cpu, clock = best(work)
        print(f"{name:34}{cpu:>9.3f}{clock:>9.3f}")


if __name__ == "__main__":
    main()
