"""Trackers of other libraries beside `blob`, each with its defaults and tuned by `tune` on the same budget.

    python -m benchmarks peers [simulated] [real] [rates] [speed] [--environments DIR] [--trials 30]
        [--seeds 20000:20003] [--data FOLDER] [--chart FILE.svg]

The libraries are installed into DIR (benchmarks/peers/environments.py); one that cannot be is left out, and pip says
why. All trackers get the same boxes and scores. People are compared by IoU of boxes; groups are those of the default
grouping, from the feet of the boxes. Tuning: HOTA on the training seed 0 of tuning_suites/peers.toml, choice on
validation seeds; Stone Soup, which is slow, on its first two scenes.

simulated: the scenes of tuning_suites/peers.toml, test seeds: means, and HOTA minus that of `blob` with its defaults,
paired over scenes. Two rows have the ids of `blob` with the detected boxes, that is without its filter of boxes; the
second also without the boxes that it predicts of hidden people, which most peers do not report.
real: PETS09-S2L1-first200, TUD-Campus and AVG-TownCentre-first225 with their det/det.txt: one recording each, so
indicative. The parameters are those tuned on simulated scenes.
rates: HOTA with defaults, mean of RATED, over the frame rate and the probability of detection; with --chart a picture.
speed: CPU time of a step, in ms per frame, of one thread, after a warm-up; the best of three rounds. Stone Soup
once, on 20 squares alone.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from benchmarks.blob.boxes import cpu_seconds, of_boxes
from benchmarks.peers import synthetic
from benchmarks.peers.adapters import PEERS, answer
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support import chart
from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE, add_data, add_seeds, new_parser, one_thread
from benchmarks.support.tables import head, number, row, signed
from scenarios import load
from scenarios.loading.resolve import resolve
from sim.geometry.boxes import box_iou
from sim.sequence import simulate
from sim.types import Detections, Frame, Tracks
from sim.types import Sequence as Recording
from tracking.config import Config
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracker import Blob
from tracking.recordings.source import open_source
from tracking.running.run import track
from tracking.scoring import evaluate
from tracking.stats import mean_interval
from tracking.tuning.result import short
from tracking.tuning.search import tune

SUITE = Path(__file__).parents[1] / "tuning_suites" / "peers.toml"
SHORT = ("pillar", "cross")  # scenes on which Stone Soup is tuned
PARTS = ("simulated", "real", "rates", "speed")
RATED = ("cross", "crowd", "street", "party")
RATES, DETECTED = (2.5, 5.0, 10.0, 25.0), (0.5, 0.7, 0.9)  # frames/s; probability of detection
FIELDS = ((20, 1.0, 0.0), (20, 0.9, 5.0), (100, 0.9, 5.0))  # squares, detection probability, clutter
SHOWN = ("HOTA", "IDF1", "IDSW", "group_F1")
SLOW = "Stone Soup JPDA"
Entry = tuple[type, Config]  # a tracker class and its parameters


class BlobOnDetections(Blob):
    """`blob` that reports, in place of its filtered box of a detected person, the detection with the highest IoU."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the tracks of `blob` with detected boxes."""
        found = super().step(frame, detections)
        box, seen = found.box.copy(), np.flatnonzero(found.measured)
        if detections is not None and len(detections.box):
            overlap = box_iou(box[seen][:, None], detections.box[None])
            rows, columns = linear_sum_assignment(-overlap)
            box[seen[rows]] = detections.box[columns]
        return answer(frame, found.id, box, found.score)


class BlobDetectedOnly(BlobOnDetections):
    """The same without people whom it predicts."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the tracks of people who are detected in this frame."""
        found = super().step(frame, detections)
        seen = (found.box[:, None] == detections.box[None]).all(2).any(1)
        return answer(frame, found.id[seen], found.box[seen], found.score[seen])


BOXES = {"norfair": "filtered", SLOW: "filtered"}  # what a peer reports; the others: as detected
BLOBS: dict[str, tuple[str, Entry]] = {
    "`blob`": ("filtered", (Blob, BlobConfig())),
    "`blob`, detected boxes": ("as detected", (BlobOnDetections, BlobConfig())),
    "`blob`, detected boxes, none predicted": ("as detected", (BlobDetectedOnly, BlobConfig())),
}


def tuned(name: str, kind: type, library: str, trials: int) -> Config:
    """Returns the parameters that `tune` finds for a tracker, and prints what it changed; library: name and version."""
    scenes = SHORT if name == SLOW else SUITE
    found = tune(
        kind, scenes, trials, objective="HOTA", detections="file", similarity="boxes", check=None, finalists=3,
        seeds=range(1), validation=range(10_000, 10_002), test=range(20_900, 20_901),
    )  # fmt: skip
    changed = ", ".join(f"{key} {short(old)} → {short(new)}" for key, (old, new) in found.changed.items())
    row([name, library, changed or "nothing"])
    return found.config


def entries(peers: dict[str, type], libraries: dict[str, str], trials: int) -> dict[str, tuple[str, Entry]]:
    """Returns the trackers by name, with what boxes they report: with defaults and tuned."""
    print(f"\nWhat {trials} trials of tuning changed")
    head(["tracker", "library", "parameters"])
    found = dict(BLOBS) | {"`blob`, tuned": ("filtered", (Blob, tuned("`blob`", Blob, "", trials)))}
    for name, (library, _) in PEERS.items():
        if name not in peers:
            row([name, "left out: pip could not install it", ""])
            continue
        boxes, kind = BOXES.get(name, "as detected"), peers[name]
        found[name] = boxes, (kind, kind.config_class())
        found[f"{name}, tuned"] = boxes, (kind, tuned(name, kind, libraries[library], trials))
    return found


def scores(entry: Entry, sequence: Recording) -> dict[str, float]:
    """Returns the scores of a tracker on the stored or simulated detections of a sequence."""
    kind, config = entry
    run = track(kind, sequence, params=config, detections="file")
    return dict(evaluate(sequence.truth, run, similarity="boxes"))


def table(title: str, sequences: Sequence[Recording], every: dict[str, tuple[str, Entry]]) -> None:
    """Prints the means of all trackers, and the difference of HOTA from the first if there are several sequences."""
    print(f"\n{title}")
    several = len(sequences) > 1
    head(["tracker", "boxes", *SHOWN, *(["HOTA minus that of `blob`"] if several else [])])
    first: Any = None
    for name, (boxes, entry) in every.items():
        found = [scores(entry, sequence) for sequence in sequences]
        hota = np.array([each["HOTA"] for each in found])
        first = hota if first is None else first
        ends = (float(end[0]) for end in mean_interval((hota - first)[:, None])) if several else ()
        cells = [number(float(np.mean([each[key] for each in found]))) for key in SHOWN]
        row([name, boxes, *cells, *([signed(*ends)] if several else [])])


def rates(peers: dict[str, type], file: Path | None) -> None:
    kinds = {"`blob`": Blob} | {name: kind for name, kind in peers.items() if name != SLOW}
    print(f"\nHOTA with defaults, mean of {', '.join(RATED)}, seed 20000")
    head(["detected", "frames/s", *kinds])
    panels = []
    for detected in DETECTED:
        means: dict[str, list[float]] = {}
        for fps in RATES:
            settings = (f"camera.fps={fps}", f"sensor.detect_prob={detected}")
            scenes = [simulate(load(name, set=settings), 20_000, streams=()) for name in RATED]
            for name, kind in kinds.items():
                every = [scores((kind, kind.config_class()), scene)["HOTA"] for scene in scenes]
                means.setdefault(name, []).append(float(np.mean(every)))
            row([f"{detected:g}", f"{fps:g}", *(f"{values[-1]:.3f}" for values in means.values())])
        ticks = [f"{fps:g}" for fps in RATES]
        x = np.log2(RATES).tolist()
        panels.append(chart.Panel(f"HOTA, {detected:.0%} detected", x, means, "frames/s", y_range=(0, 1), ticks=ticks))
    if file:
        chart.lines(panels, file, columns=3)


def speed(peers: dict[str, type]) -> None:
    print("\nCPU time of a step, ms per frame; squares, detected, false boxes per frame")
    head(["tracker", *(f"{n}, {p:g}, {clutter:g}" for n, p, clutter in FIELDS)])
    for name, kind in {"`blob`": Blob, **peers}.items():
        cells = []
        for n, p_detect, clutter in FIELDS:
            if name == SLOW and n > 20:
                cells.append("–")
                continue
            scene = of_boxes(synthetic.plain(n, 40 if name == SLOW else 200, p_detect, clutter)).sequence
            best = min(cpu_seconds(kind, scene) for _ in range(1 if name == SLOW else 3))
            cells.append(f"{1000 * best / (scene.length or 1):.2f}")
        row([name, *cells])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("part", nargs="*", help=f"{', '.join(PARTS)}; all if absent")
    parser.add_argument("--environments", type=Path, default=DEFAULT, metavar="DIR", help="folder of the libraries")
    parser.add_argument("--trials", type=int, default=30, help="trials of each search")
    parser.add_argument("--chart", type=Path, help="picture of `rates`")
    add_seeds(parser, "20000:20003", what="simulated: ")
    add_data(parser)
    args = parser.parse_intermixed_args()
    if unknown := set(args.part) - set(PARTS):
        parser.error(f"no part {', '.join(sorted(unknown))}; parts: {', '.join(PARTS)}")
    one_thread()
    warnings.simplefilter("ignore")
    parts, libraries = args.part or PARTS, make_environments(args.environments)
    peers = {name: kind for name, (library, kind) in PEERS.items() if libraries[library]}
    if {"simulated", "real"} & set(parts):
        every = entries(peers, libraries, args.trials)
    if "simulated" in parts:
        made = [simulate(e.scenario, s, e.repeat, streams=()) for e in resolve(str(SUITE)) for s in args.seeds]
        table(f"Scenes with occlusion, test seeds, mean of {len(made)}", made, every)
    if "real" in parts:
        for path in (PETS, CAMPUS, TOWN_CENTRE):
            table(f"{Path(path).name}, det.txt", open_source(args.data / path, images=False), every)
    if "rates" in parts:
        rates(peers, args.chart)
    if "speed" in parts:
        speed(peers)


if __name__ == "__main__":
    main()
