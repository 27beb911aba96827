"""How long groups and events take: 1000 people x 600 frames on 60 x 60 m, in groups of 1 to 4, one in five standing.

    PYTHONPATH=. OMP_NUM_THREADS=1 python benchmarks/groups_speed.py [--people 1000] [--frames 600] [--repeat 3]

CPU time, best of `repeat`. Truth: membership with hard negatives, crossings, queues, hulls. Tracks: the baseline rule
from links to labels (crossings, queues and hulls come on top, as above).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from sim.truth.crossing_events import crossings
from sim.truth.group_hulls import groups_over_time
from sim.truth.merge_split_events import groups_and_events
from sim.truth.queue_detection import queues
from tracking.grouping.group_labels import label_people
from tracking.grouping.link_rule import LinkRule, find_links

FPS = 10.0
SIDE = 60.0  # m
STANDING = 0.2  # of the groups


def crowd(people: int, frames: int, seed: int = 0) -> tuple[np.ndarray, ...]:
    """pos, vel (T, P, 2), intent (T, P): groups walk straight on and turn about at the walls; some unite or part."""
    r = np.random.default_rng(seed)
    sizes = r.choice([1, 1, 2, 2, 3, 4], people)
    sizes = sizes[: int(np.searchsorted(np.cumsum(sizes), people)) + 1]
    group = np.repeat(np.arange(len(sizes)), sizes)[:people]
    rank = np.concatenate([np.arange(n) for n in sizes])[:people]
    heading, speed = r.uniform(0, 2 * np.pi, len(sizes)), np.clip(r.normal(1.34, 0.26, len(sizes)), 0.5, 2.2)
    speed[r.random(len(sizes)) < STANDING] = 0.0
    step = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    start = r.uniform(0, SIDE, (len(sizes), 2))
    start[1::7] = start[:-1:7] + np.array([0, 3.2])  # comes near, walks along, goes on
    step[1::7] = step[:-1:7] - np.array([0, 0.1])
    t = np.arange(frames)[:, None, None] / FPS
    straight = start[group] + np.stack([0.75 * rank, 0 * rank], axis=1) + t * step[group]
    pos = np.abs(straight % (2 * SIDE) - SIDE) + 0.05 * np.sin(2 * t + r.uniform(0, 6, (people, 2)))
    intent = np.tile(group, (frames, 1))
    for first in range(0, len(sizes) - 1, 7):
        intent[frames // 3 : 2 * frames // 3, group == first + 1] = first
    return pos, np.gradient(pos, 1 / FPS, axis=0), intent


def clock(name: str, repeat: int, work: Callable[[], object]) -> float:
    """Least CPU seconds of `repeat` runs, printed."""
    best = np.inf
    for _ in range(repeat):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    print(f"  {name:12} {best:6.2f} s", flush=True)
    return best


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=1000)
    parser.add_argument("--frames", type=int, default=600)
    parser.add_argument("--repeat", type=int, default=3)
    a = parser.parse_args()
    pos, vel, intent = crowd(a.people, a.frames)
    there = np.ones(intent.shape, bool)
    found = groups_and_events(pos, vel, there, intent, FPS)
    met, lines = crossings(pos, vel, there, found.group, FPS), queues(pos, vel, there, FPS)
    print(
        f"{a.people} people, {a.frames} frames: {len(found.events)} events, {len(met)} crossings, {len(lines)} queues,"
    )
    frame, column = np.nonzero(there)
    rows = pos[frame, column], vel[frame, column]
    label = found.group[frame, column]
    hulls = groups_over_time(frame, column, label, *rows, 0, a.frames)
    print(f"{sum(len(g.id) for g in hulls)} hulls, {len(found.near.a)} hard negatives")
    rule = LinkRule()
    links = find_links(frame, column, *rows, a.frames, FPS, rule)
    truth = {
        "membership": lambda: groups_and_events(pos, vel, there, intent, FPS),
        "crossings": lambda: crossings(pos, vel, there, found.group, FPS),
        "queues": lambda: queues(pos, vel, there, FPS),
        "hulls": lambda: groups_over_time(frame, column, label, *rows, 0, a.frames),
    }
    print(f"  truth: {sum(clock(name, a.repeat, work) for name, work in truth.items()):.2f} s")
    tracks = {
        "links": lambda: find_links(frame, column, *rows, a.frames, FPS, rule),
        "labels": lambda: label_people(frame, column, pos, links, FPS, rule),
    }
    print(f"  baseline rule: {sum(clock(name, a.repeat, work) for name, work in tracks.items()):.2f} s")


if __name__ == "__main__":
    main()
