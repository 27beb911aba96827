"""Scores of people beside TrackEval: equal? how fast?

    python -m benchmarks.metrics trackeval [--frames 1000] [--people 30] [--rounds 7] [--data FOLDER]
    python -m benchmarks.metrics files [--cases 200]

trackeval: HOTA, CLEAR and Identity of a random crowd with misses, false alarms and changed ids are computed by both in
turn; the best wall time of each counts. Ours includes the search for pairs of near people; TrackEval gets tables of
similarity that were made before. Then the detections and true boxes of real recordings under --data, if there are any,
are scored by both. Printed: the greatest difference of any score for each recording. Exit code 1 above TOLERANCE.

files: random datasets of three sequences are written as labels and results of MOTChallenge and KITTI, with distractors,
levels of occlusion and truncation, small boxes and ignored regions. TrackEval's MotChallenge2DBox and Kitti2DBox (both
classes) read and score the same files. Printed: the greatest difference of each score, in any sequence and in the
pooled row, which is COMBINED_SEQ there. Exit code 1 above EXACT.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import tempfile
import warnings
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.support.options import add_data, new_parser
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_in_turn
from tracking.recordings.mot_table import read_table
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_checked_tracks
from tracking.scoring import evaluate, pooled
from tracking.scoring.evaluation import weighted_people
from tracking.scoring.frame_weights import unweighted
from tracking.scoring.hota import hota_sums
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import Pairs, box_pairs, point_pairs

REACH = 2.0  # m
TOLERANCE = 1e-6
EXACT = 1e-12
FPS = 10.0
RENAMED = {"TP": "CLR_TP", "FN": "CLR_FN", "FP": "CLR_FP"}
Side = tuple[FrameRows, np.ndarray]


def crowd(frames: int, people: int, r: np.random.Generator) -> tuple[Side, Side]:
    """Returns true people and tracks: rows and positions (N, 2), m, of people who wander in 16 m x 10 m.

    Tracks miss one person in ten, add 3 false ones per frame and change ids.
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
            side.append((np.full(len(i), frame), i, pos))
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
    return unweighted(weighted_people(pairs, pairs.size, hota_sums(pairs, pairs.size)), pairs.size)


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
    worst = {name: greatest_difference(pairs) for name, pairs in recordings(args.data)}
    for kind, value in worst.items():
        print(f"{kind}: greatest difference from TrackEval {value:.1e}")
    return int(max(worst.values(), default=0.0) > TOLERANCE)


KINDS = {"Pedestrian": 1, "Person": 7, "Car": 3, "Van": 8, "Cyclist": 2}  # types of KITTI, classes of MOTChallenge
SIDE = 400  # px, of the pictures
ROW = "{} {} {} {} {} -10 {:.2f} {:.2f} {:.2f} {:.2f} -1 -1 -1 -1 -1 -1 -1"  # of KITTI
BOTH = {"MOTChallenge": ("pedestrian",), "KITTI": ("pedestrian", "car")}  # classes that are scored, by protocol
Labels = list[tuple[int, int, str, int, int, np.ndarray]]  # frame from 1, id, type, truncated, occluded, box


def labels_and_tracks(r: np.random.Generator, frames: int) -> tuple[Labels, Labels]:
    """Returns random labels, with regions of id -1, and tracks near them and elsewhere; boxes are left, top, width and
    height in px, of whole hundredths."""
    people, regions = 14, r.uniform((0, 0, 60, 40), (300, 300, 160, 120), (2, 4))
    place, step, height = r.uniform(0, 300, (people, 2)), r.normal(0, 2, (people, 2)), r.uniform(15, 90, people)
    kind = r.choice([*KINDS], people, p=[0.4, 0.15, 0.25, 0.1, 0.1])
    kind[0] = "Pedestrian"  # MOTChallenge's labels have people
    labels: Labels = []
    tracks: Labels = []
    for frame in range(1, frames + 1):
        labels += [(frame, -1, "DontCare", -1, -1, region) for region in regions]
        for k in np.flatnonzero(r.random(people) < 0.9).tolist():
            box = np.array([*(place[k] + frame * step[k]), 0.4 * height[k], height[k]])
            labels.append((frame, k, kind[k], int(r.random() < 0.1), int(r.choice(4, p=[0.5, 0.2, 0.2, 0.1])), box))
            for n in range(int(r.random() < 0.85) + int(r.random() < 0.15)):
                number, moved = k + 50 * n + 100 * int(r.random() < 0.05), np.add(box, [*r.normal(0, 4, 2), 0, 0])
                tracks.append((frame, number, "Car" if kind[k] in ("Car", "Van") else "Pedestrian", 0, 0, moved))
        for n, found in enumerate(r.uniform((0, 0, 10, 15), (SIDE, SIDE, 40, 60), (4, 4))):
            tracks.append((frame, 200 + n, str(r.choice(["Car", "Pedestrian"])), 0, 0, found))
    rounded = [[(*row[:-1], np.round(row[-1], 2)) for row in rows] for rows in (labels, tracks)]
    return rounded[0], rounded[1]


def written_dataset(folder: Path, protocol: str, seed: int, sequences: int = 3) -> dict[str, tuple[Path, Path]]:
    """Writes a random dataset where TrackEval looks for it; returns labels and results of each sequence, by name."""
    r, found = np.random.default_rng(seed), {}
    mot = protocol == "MOTChallenge"
    for k in range(sequences):
        frames, name = int(r.integers(3, 25)), f"MOT17-{k:02}" if mot else f"{k:04}"
        labels, tracks = labels_and_tracks(r, frames)
        truth = folder / "gt" / (f"{name}/gt/gt.txt" if mot else f"label_02/{name}.txt")
        files = truth, folder / "trackers" / "t" / "data" / f"{name}.txt"
        for path, rows in zip(files, (labels, tracks), strict=True):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text("".join(f"{_line(row, mot, path == truth)}\n" for row in rows if row[1] >= 0 or not mot))
        found[name] = files
        if mot:
            text = f"[Sequence]\nname={name}\nframeRate=10\nseqLength={frames}\n"
            (truth.parents[1] / "seqinfo.ini").write_text(text)
        with (folder / "gt" / "evaluate_tracking.seqmap.training").open("a") as file:
            file.write(f"{name} empty 000000 {frames:06}\n")
    return found


def _line(row: tuple, mot: bool, label: bool) -> str:
    frame, number, kind, truncated, occluded, (left, top, width, height) = row
    if not mot:
        right, bottom = left + width, top + height
        return ROW.format(frame - 1, number, kind, truncated, occluded, left, top, right, bottom) + " 0.9" * (not label)
    end = f"{1 - truncated},{KINDS[kind]},1" if label else "0.9,-1,-1,-1"
    return f"{frame},{number + 1},{left:.2f},{top:.2f},{width:.2f},{height:.2f},{end}"


def trackeval_rows(folder: Path, protocol: str, name: str) -> dict[str, dict[str, float]]:
    """Returns the scores that TrackEval makes of a written dataset, under our keys, by sequence and "pooled". name: of
    the class that is scored."""
    with contextlib.redirect_stdout(io.StringIO()):
        from trackeval import datasets
    places = {"GT_FOLDER": str(folder / "gt"), "TRACKERS_FOLDER": str(folder / "trackers"), "PRINT_CONFIG": False}
    if protocol == "KITTI":
        dataset = datasets.Kitti2DBox(places)
    else:
        names = dict.fromkeys(path.name for path in sorted((folder / "gt").iterdir()) if path.is_dir())
        dataset = datasets.MotChallenge2DBox(
            {**places, "BENCHMARK": "MOT17", "SKIP_SPLIT_FOL": True, "SEQ_INFO": names, "DO_PREPROC": True}
        )
    data = {k: dataset.get_preprocessed_seq_data(dataset.get_raw_seq_data("t", k), name) for k in dataset.seq_list}
    rows: dict[str, dict[str, float]] = {}
    for metric in trackeval_metrics():
        found = {sequence: metric.eval_sequence(one) for sequence, one in data.items()}
        for sequence, one in {**found, "pooled": metric.combine_sequences(found)}.items():
            rows.setdefault(sequence, {}).update({key: float(np.mean(value)) for key, value in one.items()})
    return rows


def our_rows(files: dict[str, tuple[Path, Path]], name: str) -> dict[str, dict[str, float]]:
    """Returns our scores of the same files, by sequence and "pooled"."""
    kind = None if name == "pedestrian" else name
    scores = {}
    for sequence, (truth, tracks) in files.items():
        (opened,) = open_source(truth.parents[1] if truth.name == "gt.txt" else truth, person_class=kind)
        classes = None if kind is None else (kind,)
        run = read_checked_tracks(tracks, fps=opened.fps, length=opened.length, person_class=classes)
        scores[sequence] = evaluate(opened.truth, run)
    return {**scores, "pooled": pooled(scores.values())}


def file_differences(protocol: str, seeds: range) -> dict[str, tuple[float, float]]:
    """Returns by key the greatest difference from TrackEval in any sequence and in the pooled row, over random datasets
    and the classes of a protocol."""
    worst: dict[str, tuple[float, float]] = {}
    for seed in seeds:
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            files = written_dataset(Path(folder), protocol, seed)
            for name in BOTH[protocol]:
                ours, theirs = our_rows(files, name), trackeval_rows(Path(folder), protocol, name)
                for key in ours["pooled"]:
                    off = {k: abs(row[key] - theirs[k][RENAMED.get(key, key)]) for k, row in ours.items()}
                    one, every = worst.get(key, (0.0, 0.0))
                    worst[key] = max(one, *(off[k] for k in files)), max(every, off["pooled"])
    return worst


def compare_files(cases: int) -> int:
    found = {protocol: file_differences(protocol, range(cases)) for protocol in BOTH}
    head(["score", *(f"{protocol}, {what}" for protocol in BOTH for what in ("a sequence", "COMBINED"))])
    for key in found["KITTI"]:
        row([key, *(f"{value:.0e}" for protocol in BOTH for value in found[protocol][key])])
    return int(max(value for rows in found.values() for pair in rows.values() for value in pair) > EXACT)


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["trackeval", "files"])
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--people", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=7, help="runs of which the best counts")
    parser.add_argument("--cases", type=int, default=200, help="random datasets")
    add_data(parser)
    args = parser.parse_args()
    return compare_files(args.cases) if args.mode == "files" else trackeval(args)


if __name__ == "__main__":
    raise SystemExit(main())
