"""`blob` on boxes beside roboflow's SORT, ByteTrack and OC-SORT: speed and scores, on the same MOT text.

usage: python benchmarks/blob_vs_peers.py [PART …] --peer-python PYTHON [--data DIR] [--rounds 5] [--scenes 24]

speed: squares with constant velocity (peers/synthetic.plain), 20 and 100, clean and hard; CPU seconds of one thread,
after a warm-up; every round times each tracker in turn, the best of each counts.
train: scenes with occlusion (peers/synthetic.walk) of the seeds on which defaults were chosen; test: the same of seeds
that nobody looked at; generated: the catalogue's scenes with their own sensor, test seeds. Means over scenes and, for
each other tracker, blob's HOTA less its HOTA with a 95 % interval, paired over scenes.
real: PETS09-S2L1-first200 and TUD-Campus, det/det.txt, with intervals by block bootstrap.
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
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from peers import synthetic
from peers.scores import bootstrap, mot_scores

from scenarios import load
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Detections, Frame, Sequence
from tracking.papers.blob.config import BlobConfig
from tracking.prepare import prepare
from tracking.stats import bootstrap as over_sequences

PEERS = ("sort", "bytetrack", "ocsort")
RUNNER = Path(__file__).parent / "peers" / "run_roboflow.py"
WARM = 30  # frames tracked before the clock starts
REAL = ("PETS09-S2L1-first200", "TUD-Campus")
CATALOGUE = ("merge", "split", "cross", "pass-by", "side-by-side", "pillar", "door", "crowd", "clutter", "party")


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
        made = [ready.step(f) if checked else ready.tracker.step(f, f.detections) for f in part]
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


@dataclass(frozen=True)
class Scene:
    """A sequence with detections, and per frame its true ids and boxes."""

    sequence: Sequence
    ids: list[np.ndarray]
    boxes: list[np.ndarray]


def walks(seeds: range) -> list[Scene]:
    made = [synthetic.walk(seed, seconds=20) for seed in seeds]
    return [Scene(as_sequence(b), b.ids, b.truth) for b in made]


def generated(seeds: range) -> list[Scene]:
    return [labelled(simulate(load(name), seed, streams=())) for name in CATALOGUE for seed in seeds]


def labelled(sequence: Sequence) -> Scene:
    truth = sequence.truth
    rows = [truth.rows(k) for k in range(1, truth.length + 1)]
    return Scene(sequence, [truth.id[r] for r in rows], [truth.box[r] for r in rows])


def everybody(python: str, folder: Path, sequence: Sequence) -> dict[str, list]:
    """Answers of blob as it is, with the paper's association and with its first defaults, and of the peers."""
    det = folder / "det.txt"
    write_mot(sequence, det)
    configs = {"blob": {}, "blob, nearest": {"association": "nearest"}, "blob, frozen": BlobConfig.frozen().as_dict()}
    answers = {name: ours(sequence, params)[0] for name, params in configs.items()}
    return answers | {p: peer(python, p, det, folder / "out.txt", sequence.length)[0] for p in PEERS}


def scenes(python: str, folder: Path, title: str, made: list[Scene]) -> None:
    print(f"{title}: {len(made)} scenes, means; HOTA less the other's, 95 %")
    rows: dict[str, list[dict[str, float]]] = {}
    for scene in made:
        for name, answer in everybody(python, folder, scene.sequence).items():
            rows.setdefault(name, []).append(mot_scores(scene.ids, scene.boxes, answer))
    own = np.array([r["HOTA"] for r in rows["blob"]])
    for name, found in rows.items():
        mean, low, high = (float(v[0]) for v in over_sequences((own - [r["HOTA"] for r in found])[:, None]))
        means = "  ".join(f"{k} {np.mean([r[k] for r in found]):.3f}" for k in found[0])
        print(f"  {name:14s} {means}  blob less this: {mean:+.3f} [{low:+.3f}, {high:+.3f}]", flush=True)


def real(python: str, folder: Path, data: Path) -> None:
    for name in REAL:
        (sequence,) = open_source(data / "mot" / name, images=False)
        scene = labelled(sequence)
        answers = everybody(python, folder, sequence)
        block = max(round(sequence.fps), sequence.length // 20)
        print(
            f"{name}: {sequence.length} frames, {sequence.fps:g} fps; HOTA less the other's, 95 % by blocks of {block}"
        )
        for who, made in answers.items():
            scores = "  ".join(f"{k} {v:.3f}" for k, v in mot_scores(scene.ids, scene.boxes, made).items())
            r = np.random.default_rng(0)
            low, high = bootstrap(scene.ids, scene.boxes, answers["blob"], made, block, r)
            print(f"  {who:14s} {scores}  blob less this: [{low:+.3f}, {high:+.3f}]", flush=True)


def one_thread() -> None:
    """Restart under one thread per library, which must be said before numpy is loaded."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    if any(os.environ.get(name) != "1" for name in names):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **dict.fromkeys(names, "1")})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=["speed", "train", "test", "generated", "real"])
    parser.add_argument("--peer-python", required=True)
    parser.add_argument("--data", type=Path, default=Path(__file__).resolve().parents[2] / "shared" / "data")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--scenes", type=int, default=24, help="scenes of train and of test; generated has two of each kind"
    )
    given = parser.parse_args()
    one_thread()
    python, n = given.peer_python, given.scenes
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts = {
            "speed": lambda: speed(python, folder, given.rounds),
            "train": lambda: scenes(
                python, folder, "scenes with occlusion, training seeds", walks(range(300, 300 + n))
            ),
            "test": lambda: scenes(
                python, folder, "scenes with occlusion, test seeds", walks(range(20_000, 20_000 + n))
            ),
            "generated": lambda: scenes(python, folder, "the catalogue, test seeds", generated(range(20_000, 20_002))),
            "real": lambda: real(python, folder, given.data),
        }
        for part in given.parts:
            parts[part]()


if __name__ == "__main__":
    main()
