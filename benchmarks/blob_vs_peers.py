"""`blob` on boxes beside roboflow's SORT, ByteTrack and OC-SORT: speed and scores, on the same MOT text.

usage: python benchmarks/blob_vs_peers.py [speed] [train] [real] --peer-python PYTHON [--data DIR] [--rounds 5]

speed: squares with constant velocity (peers/synthetic.plain), 20 and 100, clean and hard; CPU seconds of one thread,
after a warm-up; every round times each tracker in turn, the best of each counts. train: scenes with occlusion (peers/synthetic.walk) on which defaults were
chosen, both associations beside the peers. real: PETS09-S2L1-first200 and TUD-Campus, det/det.txt, with intervals by
block bootstrap.
The peers' interpreter needs `trackers` and `supervision` and nothing of ours; input is read before any clock starts.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from peers import synthetic
from peers.scores import bootstrap, mot_scores

from sim.io.source import open_source
from sim.types import Detections, Frame, Sequence
from tracking.run import prepare

PEERS = ("sort", "bytetrack", "ocsort")
RUNNER = Path(__file__).parent / "peers" / "run_roboflow.py"
WARM = 30  # frames tracked before the clock starts
REAL = ("PETS09-S2L1-first200", "TUD-Campus")


def as_sequence(boxes: synthetic.Boxes) -> Sequence:
    frames = []
    for k, rows in enumerate(boxes.found):
        box = np.ascontiguousarray(rows[:, :4])
        found = Detections(k + 1, k / boxes.fps, "image", box[:, :2] + box[:, 2:] / 2, None, box, rows[:, 4].copy())
        frames.append(Frame(k + 1, k / boxes.fps, detections=found))
    size = boxes.size
    return Sequence(boxes.name, boxes.fps, len(frames), lambda: iter(frames), image_size=size, has_detections=True)


def write_mot(sequence: Sequence, path: Path) -> None:
    with path.open("w") as file:
        for frame in sequence:
            d = frame.detections
            for box, score in zip(d.box, d.score, strict=True) if d is not None and d.box is not None else ():
                file.write(f"{frame.index},-1," + ",".join(f"{v:.4f}" for v in (*box, score)) + ",-1,-1,-1\n")


def ours(sequence: Sequence, params: dict | None = None, *, checked: bool = True):
    """(ids, boxes) per frame and the CPU seconds in `step` (with the checks of `track` around it, unless asked not)."""
    ready = prepare("blob", sequence, params=params)
    frames = list(ready.frames())
    for part in (frames[:WARM], frames):
        ready.reset(0)
        start = time.process_time()
        made = [ready.answer(f) if checked else ready.tracker.step(f, f.detections) for f in part]
    return [(t.id, t.box) for t in made], time.process_time() - start


def peer(python: str, name: str, det: Path, out: Path, frames: int):
    """The same of a peer in its own environment."""
    answer = subprocess.run([python, RUNNER, name, det, out], capture_output=True, text=True, check=True)
    rows = np.loadtxt(out, delimiter=",", ndmin=2) if out.stat().st_size else np.zeros((0, 10))
    parts = [rows[rows[:, 0] == k] for k in range(1, frames + 1)]
    return [(p[:, 1].astype(np.int64), p[:, 2:6]) for p in parts], json.loads(answer.stdout.splitlines()[-1])["seconds"]


def speed(python: str, folder: Path, rounds: int) -> None:
    print(f"speed, frames per CPU second (best of {rounds} rounds) and ratio to SORT; HOTA")
    for n, p_detect, clutter in ((20, 1.0, 0.0), (100, 1.0, 0.0), (20, 0.9, 5.0), (100, 0.9, 5.0)):
        boxes = synthetic.plain(n, p_detect=p_detect, clutter=clutter)
        sequence, det = as_sequence(boxes), folder / f"{boxes.name}.txt"
        write_mot(sequence, det)
        spent, answers = {name: [] for name in ("blob", "blob, step only", *PEERS)}, {}
        for _ in range(rounds):
            answers["blob"], seconds = ours(sequence)
            spent["blob"].append(seconds)
            answers["blob, step only"], seconds = ours(sequence, checked=False)
            spent["blob, step only"].append(seconds)
            for name in PEERS:
                answers[name], seconds = peer(python, name, det, folder / "out.txt", len(boxes.found))
                spent[name].append(seconds)
        for name, seconds in spent.items():
            ratio = min(spent["sort"]) / min(seconds)
            hota = mot_scores(boxes.ids, boxes.truth, answers[name])["HOTA"]
            rate = len(boxes.found) / min(seconds)
            print(f"  {boxes.name:16s} {name:16s} {rate:8.0f} frames/s  x{ratio:5.2f}  HOTA {hota:.3f}", flush=True)


def train(python: str, folder: Path, seeds: range) -> None:
    print(f"scenes with occlusion, training seeds {seeds.start}:{seeds.stop}, means")
    scenes = [synthetic.walk(seed, seconds=20) for seed in seeds]
    sequences = [as_sequence(s) for s in scenes]
    answers = {a: [ours(s, {"association": a})[0] for s in sequences] for a in ("nearest", "optimal")}
    for name in PEERS:
        answers[name] = []
        for s in sequences:
            write_mot(s, folder / "det.txt")
            answers[name].append(peer(python, name, folder / "det.txt", folder / "out.txt", s.length)[0])
    for name, made in answers.items():
        rows = [mot_scores(s.ids, s.truth, a) for s, a in zip(scenes, made, strict=True)]
        means = {k: float(np.mean([r[k] for r in rows])) for k in rows[0]}
        print(f"  {name:12s} " + "  ".join(f"{k} {v:.3f}" for k, v in means.items()), flush=True)


def real(python: str, folder: Path, data: Path) -> None:
    for name in REAL:
        (sequence,) = open_source(data / "mot" / name)
        truth = sequence.truth
        frames = range(1, truth.length + 1)
        ids, boxes = [truth.id[truth.rows(k)] for k in frames], [truth.box[truth.rows(k)] for k in frames]
        det = folder / f"{name}.txt"
        write_mot(sequence, det)
        answers = {"blob": ours(sequence)[0], "blob, nearest": ours(sequence, {"association": "nearest"})[0]}
        answers |= {p: peer(python, p, det, folder / "out.txt", truth.length)[0] for p in PEERS}
        block = max(round(truth.fps), truth.length // 20)
        print(f"{name}: {truth.length} frames, {truth.fps:g} fps; HOTA less the other's, 95 % by blocks of {block}")
        for who, made in answers.items():
            scores = "  ".join(f"{k} {v:.3f}" for k, v in mot_scores(ids, boxes, made).items())
            low, high = bootstrap(ids, boxes, answers["blob"], made, block, np.random.default_rng(0))
            print(f"  {who:14s} {scores}  blob less this: [{low:+.3f}, {high:+.3f}]", flush=True)


def one_thread() -> None:
    """Restart under one thread per library, which must be said before numpy is loaded."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    if any(os.environ.get(name) != "1" for name in names):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **dict.fromkeys(names, "1")})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=["speed", "train", "real"])
    parser.add_argument("--peer-python", required=True)
    parser.add_argument("--data", type=Path, default=Path(__file__).resolve().parents[2] / "shared" / "data")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seeds", type=int, default=24, help="training scenes")
    given = parser.parse_args()
    one_thread()
    with tempfile.TemporaryDirectory() as folder:
        for part in given.parts:
            if part == "speed":
                speed(given.peer_python, Path(folder), given.rounds)
            elif part == "train":
                train(given.peer_python, Path(folder), range(300, 300 + given.seeds))
            elif part == "real":
                real(given.peer_python, Path(folder), given.data)


if __name__ == "__main__":
    main()
