"""Mode `peers` of `benchmarks.blob`: `blob` on boxes beside roboflow's SORT, ByteTrack and OC-SORT, on the same files.

speed: 20 and 100 squares with constant velocity (benchmarks/peers/synthetic.py), without and with misses and clutter.
Printed: frames per CPU second of one thread, its ratio to SORT, HOTA. Each tracker is timed in turn in every round,
after a warm-up, its input read before; the best round counts.
train, test: scenes with occlusion (synthetic.walk), of the seeds on which defaults were chosen and of others on which
nothing was. generated: the catalogue with its own sensor, test seeds; `blob` gets the camera. Printed: means over all
scenes of HOTA, DetA, AssA, MOTA, IDSW, FP, FN, IDF1, and blob's HOTA minus that of each tracker, paired over scenes,
with 95 % intervals. `blob, paper` is the preset `paper`.
real: AVG-TownCentre-first225, PETS09-S2L1-first200 and TUD-Campus with their det/det.txt; the intervals are by moving
blocks of frames.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.peers import synthetic
from benchmarks.peers.scores import bootstrap, mot_scores
from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE
from scenarios import load
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Detections, Frame
from sim.types import Sequence as Recording
from tracking.papers.blob.config import BlobConfig
from tracking.running.prepare import prepare
from tracking.stats import mean_interval

PEERS = ("sort", "bytetrack", "ocsort")
RUNNER = Path(__file__).parents[1] / "peers" / "run_roboflow.py"
WARM = 30  # frames tracked before the clock starts
CATALOGUE = ("merge", "split", "cross", "pass-by", "side-by-side", "pillar", "door", "crowd", "clutter", "party")
FIELDS = ((20, 1.0, 0.0), (100, 1.0, 0.0), (20, 0.9, 5.0), (100, 0.9, 5.0))  # squares, detection probability, clutter
VARIANTS = {
    "blob": {},
    "blob, paper": BlobConfig.preset("paper").as_dict(),
}
Answer = list[tuple[np.ndarray, np.ndarray]]
"""Per frame ids (N,) and boxes (N, 4) left, top, width, height, px."""


@dataclass(frozen=True)
class PeerRun:
    """Options of a comparison: the peers' interpreter, the folder of recordings, rounds of timing, synthetic scenes."""

    python: str
    data: Path
    rounds: int
    scenes: int


@dataclass(frozen=True)
class Scene:
    """A sequence with detections, and per frame its true ids and boxes."""

    sequence: Recording
    ids: list[np.ndarray]
    boxes: list[np.ndarray]


def as_sequence(boxes: synthetic.Boxes) -> Recording:
    """Returns the detected boxes as a sequence."""
    frames = []
    for k, rows in enumerate(boxes.found):
        box = np.ascontiguousarray(rows[:, :4])
        found = Detections(k + 1, k / boxes.fps, "image", box[:, :2] + box[:, 2:] / 2, None, box, rows[:, 4].copy())
        frames.append(Frame(k + 1, k / boxes.fps, detections=found))
    size = boxes.size
    return Recording(boxes.name, boxes.fps, len(frames), lambda: iter(frames), image_size=size, has_detections=True)


def write_mot(sequence: Recording, path: Path) -> None:
    """Writes the detections of a sequence as MOTChallenge text."""
    with path.open("w") as file:
        for frame in sequence:
            d = frame.detections
            for box, score in zip(d.box, d.score, strict=True) if d is not None and d.box is not None else ():
                file.write(f"{frame.index},-1," + ",".join(f"{v:.4f}" for v in (*box, score)) + ",-1,-1,-1\n")


def synthetic_scenes(seeds: range) -> list[Scene]:
    made = [synthetic.walk(seed, seconds=20) for seed in seeds]
    return [Scene(as_sequence(b), b.ids, b.truth) for b in made]


def catalogue_scenes(seeds: range) -> list[Scene]:
    return [with_truth(simulate(load(name), seed, streams=())) for name in CATALOGUE for seed in seeds]


def with_truth(sequence: Recording) -> Scene:
    truth = sequence.truth
    rows = [truth.rows(k) for k in range(1, truth.length + 1)]
    return Scene(sequence, [truth.id[r] for r in rows], [truth.box[r] for r in rows])


def track_blob(sequence: Recording, params: dict | None = None, *, checked: bool = True) -> tuple[Answer, float]:
    """Returns blob's answer and its CPU seconds; checked: with the checks that `track` does around each step."""
    ready = prepare("blob", sequence, params=params)
    frames = list(ready.frames())
    for part in (frames[:WARM], frames):
        ready.reset(0)
        begun = time.process_time()
        made = [ready.step(f) if checked else ready.tracker.step(f, f.detections) for f in part]
    return [(t.id, t.box) for t in made], time.process_time() - begun


def track_peer(python: str, name: str, det: Path, frames: int) -> tuple[Answer, float]:
    """Returns the answer and CPU seconds of a peer, which runs in its own environment on the file `det`."""
    out = det.with_name("out.txt")
    answer = subprocess.run([python, RUNNER, name, det, out], capture_output=True, text=True, check=True)
    rows = np.loadtxt(out, delimiter=",", ndmin=2) if out.stat().st_size else np.zeros((0, 10))
    parts = [rows[rows[:, 0] == k] for k in range(1, frames + 1)]
    return [(p[:, 1].astype(np.int64), p[:, 2:6]) for p in parts], json.loads(answer.stdout.splitlines()[-1])["seconds"]


def all_answers(python: str, folder: Path, sequence: Recording) -> dict[str, Answer]:
    """Returns the answers of blob (defaults, the preset `paper`) and of the peers."""
    det = folder / "det.txt"
    write_mot(sequence, det)
    answers = {name: track_blob(sequence, params)[0] for name, params in VARIANTS.items()}
    return answers | {name: track_peer(python, name, det, sequence.length)[0] for name in PEERS}


def peers(parts: Sequence[str], run: PeerRun) -> None:
    """Prints the chosen parts."""
    made = {
        "train": ("scenes with occlusion, training seeds", lambda: synthetic_scenes(range(300, 300 + run.scenes))),
        "test": ("scenes with occlusion, test seeds", lambda: synthetic_scenes(range(20_000, 20_000 + run.scenes))),
        "generated": ("the catalogue, test seeds", lambda: catalogue_scenes(range(20_000, 20_002))),
    }
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part in parts:
            if part == "speed":
                speed(run, folder)
            elif part == "real":
                real(run, folder)
            else:
                title, make = made[part]
                compare_scenes(run.python, folder, title, make())


def speed(run: PeerRun, folder: Path) -> None:
    print(f"speed, frames per CPU second (best of {run.rounds} rounds) and ratio to SORT; HOTA")
    for n, p_detect, clutter in FIELDS:
        boxes = synthetic.plain(n, p_detect=p_detect, clutter=clutter)
        sequence, det = as_sequence(boxes), folder / f"{boxes.name}.txt"
        write_mot(sequence, det)
        spent, answers = {name: [] for name in ("blob", "blob, step only", *PEERS)}, {}
        for _ in range(run.rounds):
            for name, seconds in spent.items():
                if name in PEERS:
                    answers[name], once = track_peer(run.python, name, det, len(boxes.found))
                else:
                    answers[name], once = track_blob(sequence, checked=name == "blob")
                seconds.append(once)
        for name, seconds in spent.items():
            ratio, rate = min(spent["sort"]) / min(seconds), len(boxes.found) / min(seconds)
            hota = mot_scores(boxes.ids, boxes.truth, answers[name])["HOTA"]
            print(f"  {boxes.name:16s} {name:16s} {rate:8.0f} frames/s  x{ratio:5.2f}  HOTA {hota:.3f}", flush=True)


def compare_scenes(python: str, folder: Path, title: str, made: list[Scene]) -> None:
    print(f"{title}: {len(made)} scenes, means; HOTA of blob minus the tracker's, 95 %")
    rows: dict[str, list[dict[str, float]]] = {}
    for scene in made:
        for name, answer in all_answers(python, folder, scene.sequence).items():
            rows.setdefault(name, []).append(mot_scores(scene.ids, scene.boxes, answer))
    own = np.array([r["HOTA"] for r in rows["blob"]])
    for name, found in rows.items():
        difference = (own - [r["HOTA"] for r in found])[:, None]
        mean, low, high = (float(v[0]) for v in mean_interval(difference))
        means = "  ".join(f"{k} {np.mean([r[k] for r in found]):.3f}" for k in found[0])
        print(f"  {name:14s} {means}  blob minus this: {mean:+.3f} [{low:+.3f}, {high:+.3f}]", flush=True)


def real(run: PeerRun, folder: Path) -> None:
    for path in (TOWN_CENTRE, PETS, CAMPUS):
        (sequence,) = open_source(run.data / path, images=False)
        scene, answers = with_truth(sequence), all_answers(run.python, folder, sequence)
        block = max(round(sequence.fps), sequence.length // 20)
        print(f"{Path(path).name}: {sequence.length} frames, {sequence.fps:g} fps;", end=" ")
        print(f"HOTA of blob minus the tracker's, 95 % by blocks of {block}")
        for name, made in answers.items():
            scores = "  ".join(f"{k} {v:.3f}" for k, v in mot_scores(scene.ids, scene.boxes, made).items())
            r = np.random.default_rng(0)
            low, high = bootstrap(scene.ids, scene.boxes, answers["blob"], made, block, r)
            print(f"  {name:14s} {scores}  blob minus this: [{low:+.3f}, {high:+.3f}]", flush=True)
