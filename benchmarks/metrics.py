"""Scores of people beside TrackEval: equal? how fast?

    python -m benchmarks.metrics trackeval [--frames 1000] [--people 30] [--rounds 7] [--cases 200] [--data FOLDER]

trackeval: HOTA, CLEAR and Identity of a random crowd with misses, false alarms and changed ids are computed by both in
turn; the best wall time of each counts. Ours includes the search for pairs of near people; TrackEval gets tables of
similarity that were made before. Then random crowds, every other one on a coarse grid (equal distances), and the
detections and true boxes of real recordings under --data, if there are any, are scored by both. Printed: the greatest
difference of any score, for each kind of crowd and each recording. Exit code 1 above TOLERANCE.
"""

from __future__ import annotations

import argparse
import contextlib
import io
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.support.options import add_data, new_parser
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_in_turn
from sim.io.formats.mot_table import read_table
from tracking.scoring.candidate_pairs import Pairs, box_pairs, point_pairs
from tracking.scoring.evaluation import weighted_people
from tracking.scoring.rows import FrameRows
from tracking.scoring.weighted_sums import unweighted

REACH = 2.0  # m
TOLERANCE = 1e-6
FPS = 10.0
RENAMED = {"TP": "CLR_TP", "FN": "CLR_FN", "FP": "CLR_FP"}
Side = tuple[FrameRows, np.ndarray]


def crowd(frames: int, people: int, r: np.random.Generator, grid: float = 0.0) -> tuple[Side, Side]:
    """Returns true people and tracks: rows and positions (N, 2), m, of people who wander in 16 m x 10 m.

    Tracks miss one person in ten, add 3 false ones per frame and change ids. grid: positions are rounded to it, m; 0:
    they are not.
    """
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
        found = np.concatenate([place[seen] + r.normal(0, 0.2, (seen.sum(), 2)), r.uniform(0, (16, 10), (3, 2))])
        ids = np.concatenate([number[seen], np.arange(fresh - 3, fresh)])
        for side, i, pos in ((true, np.arange(people), place), (est, ids, found)):
            side.append((np.full(len(i), frame), i, np.round(pos / grid) * grid if grid else pos))
    stacked = [[np.concatenate(column) for column in zip(*side, strict=True)] for side in (true, est)]
    return tuple((FrameRows(frame, ids), pos) for frame, ids, pos in stacked)


def similarity_table(pairs: Pairs, part: slice, frame: int) -> np.ndarray:
    """Returns the similarities of all rows of a frame (true, estimated); part: the pairs of that frame."""
    first, other_first = (np.searchsorted(rows.frame, frame) for rows in (pairs.true, pairs.est))
    ends = (np.searchsorted(rows.frame, frame + 1) for rows in (pairs.true, pairs.est))
    found = np.zeros((next(ends) - first, next(ends) - other_first))
    found[pairs.i[part] - first, pairs.j[part] - other_first] = pairs.s[part]
    return found


def trackeval_input(pairs: Pairs) -> dict:
    """Returns what TrackEval's metrics take of one sequence."""
    frames = np.arange(1, 1 + max(rows.frame.max(initial=0) for rows in (pairs.true, pairs.est)))
    cuts = np.searchsorted(pairs.frame, np.append(frames, len(frames) + 1))
    parts = [slice(a, b) for a, b in pairwise(cuts)]
    (true_ids, true), (est_ids, est) = pairs.true_ids, pairs.est_ids
    return {
        "gt_ids": [true[pairs.true.frame == f] for f in frames],
        "tracker_ids": [est[pairs.est.frame == f] for f in frames],
        "similarity_scores": [similarity_table(pairs, p, f) for f, p in zip(frames, parts, strict=True)],
        "num_gt_ids": len(true_ids), "num_tracker_ids": len(est_ids), "num_timesteps": len(frames),
        "num_gt_dets": len(true), "num_tracker_dets": len(est),
    }  # fmt: skip


def trackeval_metrics() -> tuple:
    """Returns TrackEval's HOTA, CLEAR and Identity."""
    with contextlib.redirect_stdout(io.StringIO()):  # it prints which packages of its other benchmarks are missing
        from trackeval import metrics
    quiet = {"THRESHOLD": 0.5, "PRINT_CONFIG": False}
    return metrics.HOTA(), metrics.CLEAR(quiet), metrics.Identity(quiet)


def people_scores(pairs: Pairs) -> dict[str, float]:
    """Returns the scores of HOTA, CLEAR and Identity by key."""
    return unweighted(weighted_people(pairs, pairs.size), pairs.size)


def greatest_difference(pairs: Pairs) -> float:
    """Returns the greatest difference of any score that both compute."""
    data = trackeval_input(pairs)
    found = {k: v for peer in trackeval_metrics() for k, v in peer.eval_sequence(data).items()}
    return max(abs(v - float(np.mean(found[RENAMED.get(k, k)]))) for k, v in people_scores(pairs).items())


def print_speed(frames: int, people: int, rounds: int) -> None:
    (true, place), (est, found) = crowd(frames, people, np.random.default_rng(0))
    pairs = point_pairs(true, est, place, found, REACH)
    data, peers = trackeval_input(pairs), trackeval_metrics()
    works = {
        "ours": lambda: people_scores(point_pairs(true, est, place, found, REACH)),
        "TrackEval": lambda: [peer.eval_sequence(data) for peer in peers],
        "ours, search for pairs alone": lambda: point_pairs(true, est, place, found, REACH),
    }
    best = best_in_turn(works, rounds)
    head([f"HOTA, CLEAR, Identity of {frames} frames × {people} people", "s", "times ours"])
    for name, spent in best.items():
        row([name, f"{spent:.3f}", f"{spent / best['ours']:.1f}"])


def recordings(data: Path) -> Iterator[tuple[str, Pairs]]:
    """Yields name and pairs of boxes of each recording: its detections stand for tracks, numbered anew per frame."""
    for folder in sorted(p for p in data.glob("mot/*") if (p / "det" / "det.txt").is_file()):
        gt, det = (read_table(folder / kind / f"{kind}.txt") for kind in ("gt", "det"))
        a, b = (np.argsort(t.frame, kind="stable") for t in (gt, det))
        numbers = np.arange(len(b)) - np.searchsorted(det.frame[b], det.frame[b])
        true, est = FrameRows(gt.frame[a], gt.id[a]), FrameRows(det.frame[b], numbers)
        yield folder.name, box_pairs(true, est, gt.box[a], det.box[b])


def trackeval(args: argparse.Namespace) -> int:
    print_speed(args.frames, args.people, args.rounds)
    worst: dict[str, float] = {}
    for seed in range(args.cases):
        r = np.random.default_rng(seed)
        (true, place), (est, found) = crowd(int(r.integers(1, 60)), int(r.integers(1, 25)), r, grid=seed % 2 / 2)
        kind = f"{(args.cases + 1 - seed % 2) // 2} crowds" + (" on a grid" if seed % 2 else "")
        worst[kind] = max(worst.get(kind, 0.0), greatest_difference(point_pairs(true, est, place, found, REACH)))
    worst |= {name: greatest_difference(pairs) for name, pairs in recordings(args.data)}
    for kind, value in worst.items():
        print(f"{kind}: greatest difference from TrackEval {value:.1e}")
    return int(max(worst.values(), default=0.0) > TOLERANCE)


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["trackeval"])
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--people", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=7, help="runs of which the best counts")
    parser.add_argument("--cases", type=int, default=200, help="random crowds")
    add_data(parser)
    args = parser.parse_args()
    return trackeval(args)


if __name__ == "__main__":
    raise SystemExit(main())
