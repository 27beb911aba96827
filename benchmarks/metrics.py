"""HOTA, CLEAR and Identity of people against TrackEval, in one run: how fast, and whether the same.

    python benchmarks/metrics.py [--frames 1000] [--people 30] [--repeat 7] [--cases 200] [--data ../shared/data]

A crowd that is missed, falsely told and confused is scored by both in turn, the best of some runs each: ours with the
search for who is near whom, TrackEval from tables of similarity it is given. Then random crowds, every other one on
a coarse grid (ties), and the detections and true boxes of real recordings, where they are. Exit code 1 where a score
differs by more than 1e-6.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import time
from itertools import pairwise
from pathlib import Path

import numpy as np

from sim.io.formats.mot_text import read_table
from tracking.scoring.candidate_pairs import Pairs, box_pairs, point_pairs
from tracking.scoring.clear import clear
from tracking.scoring.evaluation import people_scores
from tracking.scoring.hota import hota
from tracking.scoring.identity import identity
from tracking.scoring.rows import FrameRows

REACH = 2.0  # m
TOLERANCE = 1e-6
RENAMED = {"TP": "CLR_TP", "FN": "CLR_FN", "FP": "CLR_FP"}
Side = tuple[FrameRows, np.ndarray]


def crowd(frames: int, people: int, r: np.random.Generator, grid: float = 0.0) -> tuple[Side, Side]:
    """People who wander in 16 m x 10 m; tracks miss one in ten, tell 3 too many and change ids. grid: m, or 0."""
    place, velocity = r.uniform(0, (16, 10), (people, 2)), r.normal(0, 0.1, (people, 2))
    number, fresh = np.arange(people), people
    true, est = [], []
    for frame in range(1, frames + 1):
        place = place + velocity
        velocity = np.where((place < 0) | (place > (16, 10)), -velocity, velocity)
        changed = np.flatnonzero(r.random(people) < 0.005)
        number[changed] = np.arange(fresh, fresh + len(changed))
        fresh += len(changed) + 3
        seen = r.random(people) < 0.9
        told = np.concatenate([place[seen] + r.normal(0, 0.2, (seen.sum(), 2)), r.uniform(0, (16, 10), (3, 2))])
        ids = np.concatenate([number[seen], np.arange(fresh - 3, fresh)])
        for side, i, pos in ((true, np.arange(people), place), (est, ids, told)):
            side.append((np.full(len(i), frame), i, np.round(pos / grid) * grid if grid else pos))
    stacked = [[np.concatenate(column) for column in zip(*side, strict=True)] for side in (true, est)]
    return tuple((FrameRows(frame, ids), pos) for frame, ids, pos in stacked)


def table(rows: FrameRows, other: FrameRows, i: np.ndarray, j: np.ndarray, s: np.ndarray, frame: int) -> np.ndarray:
    """Similarity of all rows of a frame, from pairs (i, j, s) of that frame."""
    first, other_first = np.searchsorted(rows.frame, frame), np.searchsorted(other.frame, frame)
    shape = np.searchsorted(rows.frame, frame + 1) - first, np.searchsorted(other.frame, frame + 1) - other_first
    found = np.zeros(shape)
    found[i - first, j - other_first] = s
    return found


def given(pairs: Pairs) -> dict:
    """What TrackEval wants of one sequence: tables are filled from all possible pairs, before any clock starts."""
    frames = np.arange(1, 1 + max(rows.frame.max(initial=0) for rows in (pairs.true, pairs.est)))
    cuts = np.searchsorted(pairs.frame, np.append(frames, len(frames) + 1))
    parts = [slice(a, b) for a, b in pairwise(cuts)]
    (true_ids, true), (est_ids, est) = pairs.true_ids, pairs.est_ids
    return {
        "gt_ids": [true[pairs.true.frame == f] for f in frames],
        "tracker_ids": [est[pairs.est.frame == f] for f in frames],
        "similarity_scores": [
            table(pairs.true, pairs.est, pairs.i[p], pairs.j[p], pairs.s[p], f)
            for f, p in zip(frames, parts, strict=True)
        ],
        "num_gt_ids": len(true_ids), "num_tracker_ids": len(est_ids), "num_timesteps": len(frames),
        "num_gt_dets": len(true), "num_tracker_dets": len(est),
    }  # fmt: skip


def families():
    """TrackEval's three."""
    with contextlib.redirect_stdout(io.StringIO()):  # it says which of its other benchmarks miss a package
        from trackeval import metrics
    quiet = {"THRESHOLD": 0.5, "PRINT_CONFIG": False}
    return metrics.HOTA(), metrics.CLEAR(quiet), metrics.Identity(quiet)


def difference(pairs: Pairs, theirs: list[dict]) -> float:
    """The greatest difference of any score that both have."""
    found = {k: v for answer in theirs for k, v in answer.items()}
    return max(abs(v - float(np.mean(found[RENAMED.get(k, k)]))) for k, v in people_scores(pairs).items())


def clocked(calls: dict, repeat: int) -> dict[str, float]:
    """The best time of each call (s), all of them in turn."""
    best = dict.fromkeys(calls, np.inf)
    for _ in range(repeat):
        for name, call in calls.items():
            start = time.perf_counter()
            call()
            best[name] = min(best[name], time.perf_counter() - start)
    return best


def speed(args: argparse.Namespace) -> None:
    (true, place), (est, told) = crowd(args.frames, args.people, np.random.default_rng(0))
    pairs = point_pairs(true, est, place, told, REACH)
    data, peers = given(pairs), families()
    fresh = lambda: Pairs(pairs.true, pairs.est, pairs.i, pairs.j, pairs.s)  # noqa: E731  nothing kept from the last run
    best = clocked(
        {
            "ours": lambda: people_scores(point_pairs(true, est, place, told, REACH)),
            "TrackEval": lambda: [peer.eval_sequence(data) for peer in peers],
            "pairs": lambda: point_pairs(true, est, place, told, REACH),
            **{f.__name__: lambda f=f: f(fresh()) for f in (hota, clear, identity)},
        },
        args.repeat,
    )
    parts = ", ".join(f"{name} {1000 * best[name]:.1f}" for name in ("pairs", "hota", "clear", "identity"))
    print(f"{args.frames} frames x {args.people} people: {best['ours']:.3f} s ({parts} ms);", end=" ")
    print(f"TrackEval {best['TrackEval']:.3f} s: {best['TrackEval'] / best['ours']:.1f} times as long")


def recordings(data: Path):
    """Name and pairs of real boxes: detections as tracks, numbered anew in each frame."""
    for folder in sorted(p for p in data.glob("mot/*") if (p / "det" / "det.txt").is_file()):
        gt, det = (read_table(folder / kind / f"{kind}.txt") for kind in ("gt", "det"))
        a, b = (np.argsort(t.frame, kind="stable") for t in (gt, det))
        number = np.arange(len(b)) - np.searchsorted(det.frame[b], det.frame[b])
        yield (
            folder.name,
            box_pairs(FrameRows(gt.frame[a], gt.id[a]), FrameRows(det.frame[b], number), gt.box[a], det.box[b]),
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, value in (("frames", 1000), ("people", 30), ("repeat", 7), ("cases", 200)):
        parser.add_argument(f"--{name}", type=int, default=value)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    args = parser.parse_args()
    speed(args)
    peers, worst = families(), {}
    for seed in range(args.cases):
        r = np.random.default_rng(seed)
        (true, place), (est, told) = crowd(int(r.integers(1, 60)), int(r.integers(1, 25)), r, grid=seed % 2 / 2)
        pairs = point_pairs(true, est, place, told, REACH)
        kind = f"{(args.cases + 1 - seed % 2) // 2} crowds" + (" on a grid" if seed % 2 else "")
        worst[kind] = max(worst.get(kind, 0.0), difference(pairs, [p.eval_sequence(given(pairs)) for p in peers]))
    for name, pairs in recordings(args.data):
        worst[name] = difference(pairs, [p.eval_sequence(given(pairs)) for p in peers])
    for kind, value in worst.items():
        print(f"{kind}: greatest difference from TrackEval {value:.1e}")
    return int(max(worst.values(), default=0.0) > TOLERANCE)


if __name__ == "__main__":
    raise SystemExit(main())
