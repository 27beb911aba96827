"""Mode `peers` of `benchmarks.blob`: `blob` on boxes beside roboflow's SORT, ByteTrack and OC-SORT, on the same texts.

scenes: scenes with occlusion (benchmarks/peers/synthetic.py), of seeds on which nothing was chosen: means, and blob's
HOTA minus that of the tracker, paired over scenes.
rates: HOTA, mean of RATED, over the frame rate and the probability of detection; with --chart a picture.
real: AVG-TownCentre-first225, PETS09-S2L1-first200 and TUD-Campus with their det/det.txt: one recording each, so
indicative.
speed: 20 and 100 squares with constant velocity, without and with misses and clutter: frames per CPU second of one
thread. All trackers are timed in turn in every round, after a warm-up, their input read before; the best round counts.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.peers import synthetic
from benchmarks.support import chart
from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE
from benchmarks.support.tables import head, row, signed
from scenarios import load
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Array, Detections, Frame
from sim.types import Sequence as Recording
from tracking.papers.blob.config import BlobConfig
from tracking.running.prepare import prepare
from tracking.scoring import score_arrays
from tracking.stats import mean_interval

PEERS = {"SORT": "sort", "ByteTrack": "bytetrack", "OC-SORT": "ocsort"}
RUNNER = Path(__file__).parents[1] / "peers" / "run_roboflow.py"
WARM = 30  # frames tracked before the clock starts
CATALOGUE = ("merge", "split", "cross", "pass-by", "side-by-side", "pillar", "door", "crowd", "clutter", "party")
RATED = ("cross", "crowd", "street", "party")
RATES, DETECTED = (2.5, 5.0, 10.0, 25.0), (0.5, 0.7, 0.9)  # frames/s; probability of detection
FIELDS = ((20, 1.0, 0.0), (100, 1.0, 0.0), (20, 0.9, 5.0), (100, 0.9, 5.0))  # squares, detection probability, clutter
VARIANTS = {"`blob`": {}, "`blob`, paper": BlobConfig.load("paper").as_dict()}
SHOWN = ("HOTA", "DetA", "AssA", "MOTA", "IDF1", "IDSW")
# Columns frame, id and box of the rows of people.
Table = dict[str, Array]


@dataclass(frozen=True)
class PeerRun:
    """Options of a comparison: the peers' interpreter, the folder of recordings, rounds of timing, synthetic scenes."""

    python: str
    data: Path
    rounds: int
    scenes: int
    chart: Path | None


@dataclass(frozen=True)
class Scene:
    """A sequence with detections, and its true people."""

    sequence: Recording
    truth: Table


def table_of(ids: Iterable[Array], boxes: Iterable[Array]) -> Table:
    """Returns the rows of people by frame."""
    ids, boxes = list(ids), list(boxes)
    frame = np.repeat(np.arange(1, len(ids) + 1), [len(each) for each in ids])
    return {"frame": frame, "id": np.concatenate(ids), "box": np.concatenate(boxes).reshape(-1, 4)}


def of_boxes(boxes: synthetic.Boxes) -> Scene:
    """Returns the detected boxes as a scene."""
    frames = []
    for k, rows in enumerate(boxes.found):
        box = np.ascontiguousarray(rows[:, :4])
        found = Detections(k + 1, k / boxes.fps, "image", box[:, :2] + box[:, 2:] / 2, None, box, rows[:, 4].copy())
        frames.append(Frame(k + 1, k / boxes.fps, detections=found))
    made = Recording(
        boxes.name, boxes.fps, len(frames), lambda: iter(frames), image_size=boxes.size, has_detections=True
    )
    return Scene(made, table_of(boxes.ids, boxes.truth))


def with_truth(sequence: Recording) -> Scene:
    truth = sequence.truth
    return Scene(sequence, {"frame": truth.frame, "id": truth.id, "box": truth.box})


def synthetic_scenes(seeds: range) -> list[Scene]:
    return [of_boxes(synthetic.walk(seed, seconds=20)) for seed in seeds]


def simulated_scenes(names: Sequence[str], seeds: range, settings: Sequence[str] = ()) -> list[Scene]:
    return [with_truth(simulate(load(name, set=settings), seed, streams=())) for name in names for seed in seeds]


def scores(scene: Scene, answer: Table) -> dict[str, float]:
    """Returns the scores of an answer."""
    return dict(score_arrays(scene.truth, answer, fps=scene.sequence.fps))


def write_mot(sequence: Recording, path: Path) -> Path:
    """Writes the detections of a sequence as MOTChallenge text."""
    with path.open("w") as file:
        for frame in sequence:
            d = frame.detections
            for box, score in zip(d.box, d.score, strict=True) if d is not None and d.box is not None else ():
                file.write(f"{frame.index},-1," + ",".join(f"{v:.4f}" for v in (*box, score)) + ",-1,-1,-1\n")
    return path


def track_blob(sequence: Recording, params: dict | None = None, *, checked: bool = True) -> tuple[Table, float]:
    """Returns blob's answer and its CPU seconds; checked: with the checks that `track` does around each step."""
    ready = prepare("blob", sequence, params=params)
    frames = list(ready.frames())
    for part in (frames[:WARM], frames):
        ready.reset(0)
        begun = time.process_time()
        made = [ready.step(f) if checked else ready.tracker.step(f, f.detections) for f in part]
    return table_of([t.id for t in made], [t.box for t in made]), time.process_time() - begun


def track_peer(python: str, name: str, texts: Sequence[Path]) -> list[tuple[Table, float]]:
    """Returns the answers and CPU seconds of a peer, which runs in its own environment on the texts."""
    command = [python, str(RUNNER), PEERS[name], *map(str, texts)]
    seconds = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
    answers = []
    for text in texts:
        out = text.with_name(f"{text.name}.{PEERS[name]}")
        rows = np.loadtxt(out, delimiter=",", ndmin=2) if out.stat().st_size else np.zeros((0, 10))
        answers.append({"frame": rows[:, 0].astype(int), "id": rows[:, 1].astype(int), "box": rows[:, 2:6]})
    return list(zip(answers, seconds, strict=True))


def all_scores(python: str, scenes: Sequence[Scene]) -> dict[str, list[dict[str, float]]]:
    """Returns the scores of blob (defaults, the preset `paper`) and of the peers on each scene."""
    found = {
        name: [scores(scene, track_blob(scene.sequence, params)[0]) for scene in scenes]
        for name, params in VARIANTS.items()
    }
    with tempfile.TemporaryDirectory() as folder:
        texts = [write_mot(scene.sequence, Path(folder) / f"{k}.txt") for k, scene in enumerate(scenes)]
        for name in PEERS:
            answers = track_peer(python, name, texts)
            found[name] = [scores(scene, answer) for scene, (answer, _) in zip(scenes, answers, strict=True)]
    return found


def peers(parts: Sequence[str], run: PeerRun) -> None:
    """Prints the chosen parts."""
    for part in parts:
        {"scenes": occluded, "rates": rates, "real": real, "speed": speed}[part](run)


def occluded(run: PeerRun) -> None:
    scenes = synthetic_scenes(range(20_000, 20_000 + run.scenes))
    print(f"\nScenes with occlusion, test seeds, mean of {len(scenes)}")
    head(["tracker", *SHOWN, "HOTA of `blob` minus this"])
    found = all_scores(run.python, scenes)
    own = np.array([s["HOTA"] for s in found["`blob`"]])
    for name, each in found.items():
        difference = (own - [s["HOTA"] for s in each])[:, None]
        cells = [f"{np.mean([s[key] for s in each]):.3f}" for key in SHOWN]
        row([name, *cells, signed(*(float(end[0]) for end in mean_interval(difference)))])


def rates(run: PeerRun) -> None:
    print(f"\nHOTA, mean of {', '.join(RATED)}, seed 20000")
    head(["detected", "frames/s", *VARIANTS, *PEERS])
    panels = []
    for detected in DETECTED:
        means: dict[str, list[float]] = {}
        for fps in RATES:
            settings = (f"camera.fps={fps}", f"sensor.detect_prob={detected}")
            found = all_scores(run.python, simulated_scenes(RATED, range(20_000, 20_001), settings))
            for name, each in found.items():
                means.setdefault(name, []).append(float(np.mean([s["HOTA"] for s in each])))
            row([f"{detected:g}", f"{fps:g}", *(f"{values[-1]:.3f}" for values in means.values())])
        ticks = [f"{fps:g}" for fps in RATES]
        x = np.log2(RATES).tolist()
        panels.append(chart.Panel(f"HOTA, {detected:.0%} detected", x, means, "frames/s", y_range=(0, 1), ticks=ticks))
    if run.chart:
        chart.lines(panels, run.chart, columns=3)


def real(run: PeerRun) -> None:
    print("\nRecordings, det.txt")
    head(["recording", "tracker", *SHOWN])
    for path in (TOWN_CENTRE, PETS, CAMPUS):
        for name, (found,) in all_scores(
            run.python, [with_truth(open_source(run.data / path, images=False)[0])]
        ).items():
            row([Path(path).name, name, *(f"{found[key]:.3f}" for key in SHOWN)])


def speed(run: PeerRun) -> None:
    print(f"\nFrames per CPU second, best of {run.rounds} rounds, and times SORT")
    head(["squares, detected, false boxes", "`blob`", "`blob`, step only", *PEERS])
    for n, p_detect, clutter in FIELDS:
        scene = of_boxes(synthetic.plain(n, p_detect=p_detect, clutter=clutter))
        spent: dict[str, list[float]] = {}
        with tempfile.TemporaryDirectory() as folder:
            text = write_mot(scene.sequence, Path(folder) / "det.txt")
            for _ in range(run.rounds):
                for name, checked in (("`blob`", True), ("`blob`, step only", False)):
                    spent.setdefault(name, []).append(track_blob(scene.sequence, checked=checked)[1])
                for name in PEERS:
                    spent.setdefault(name, []).append(track_peer(run.python, name, [text])[0][1])
        best = {name: min(seconds) for name, seconds in spent.items()}
        cells = (f"{scene.sequence.length / s:.0f}, × {best['SORT'] / s:.2f}" for s in best.values())
        row([f"{n}, {p_detect:g}, {clutter:g}", *cells])
