"""Do detectors of people that train on simulated pictures find people in real ones?

    python -m benchmarks train_there --peer-python PYTHON [--from SUITE …] [--seeds 0:3] [--set K=V …]
        [--pictures 200] [--draws 3] [--detectors hog cnn] [--data FOLDER]

Two small detectors (benchmarks/peers/run_train_there.py) train on frames 1 to 100 of PETS09-S2L1, on pictures that
`generate` draws of suites or scenarios, or on both, and are tested on every second one of frames 101 to 200: the same
place, so that real frames have an advantage. Cells are the average precision at an overlap of 0.5, as COCO defines it,
with its 95 % interval; each of --draws draws the training pictures and all else that is random anew. Real frames have
labels of all people but one, who walks outside the area of the labels; whether that person is found does not count.
PYTHON: an interpreter with torch and opencv-python-headless < 5.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.generate_runs import GenerateRun
from benchmarks.support.options import PETS, add_data, add_seeds, new_parser, seeds_text
from benchmarks.support.tables import head, mean_cell, row
from sim.types import Array
from tracking.export.coco import coco

RUNNER = Path(__file__).parent / "peers" / "run_train_there.py"
TRAIN, TEST = range(1, 101), range(101, 201, 2)  # frames of PETS09-S2L1
FEW, MANY = 10, 50  # real pictures to train on
# The person without labels: frame, left, top, width, height of the box, px; straight on between these frames.
UNLABELLED = np.array([
    [75, 185, 32, 10, 17], [81, 170, 33, 10, 21], [101, 139, 37, 11, 21], [151, 43, 56, 11, 24], [174, -4, 65, 12, 26],
])  # fmt: skip
OVERLAP, RECALLS = 0.5, np.linspace(0, 1, 101)
Picture = dict[str, Any]  # file, frame, boxes and ignored boxes [left, top, width, height], px


def average_precision(truth: list[Array], ignored: list[Array], found: Array) -> float:
    """Returns the mean over 101 recalls of the best precision at this or a higher recall (Lin et al. 2014, COCO).

    truth, ignored: boxes of each picture, ltwh. found (N, 6): number of the picture, box, score. Each found box takes
    the free true box that it overlaps most, at least by OVERLAP. Others of which at least OVERLAP of the area lies in
    an ignored box do not count.
    """
    free, hits = [np.ones(len(boxes), bool) for boxes in truth], list[bool]()
    for number, *box, _ in found[np.argsort(-found[:, 5], kind="stable")]:
        k, area = int(number), box[2] * box[3]
        shared = _shared(truth[k], box)
        overlap = free[k] * shared / (np.prod(truth[k][:, 2:], axis=1) + area - shared)
        if hit := overlap.max(initial=0) >= OVERLAP:
            free[k][overlap.argmax()] = False
        if hit or _shared(ignored[k], box).max(initial=0) < OVERLAP * area:
            hits.append(hit)
    true = np.cumsum(hits)
    precision = np.maximum.accumulate((true / np.arange(1, len(true) + 1))[::-1])[::-1]
    at = np.searchsorted(true / sum(map(len, truth)), RECALLS)
    return float(np.append(precision, 0)[at].mean())


def _shared(boxes: Array, box: list[float]) -> Array:
    """Returns the area (N,) that each of some boxes shares with a box, px²."""
    left_top, right_bottom = np.array(box[:2]), np.add(box[:2], box[2:])
    sides = np.minimum(boxes[:, :2] + boxes[:, 2:], right_bottom) - np.maximum(boxes[:, :2], left_top)
    return np.asarray(np.prod(np.maximum(sides, 0), axis=1))


def labelled_pictures(source: Path, folder: Path) -> list[Picture]:
    """Returns the pictures of a dataset or recording with labels, as its COCO file has them; folder: for that file."""
    out = folder / f"{source.name}-{source.parent.name}.json"
    coco(source, out)
    content = json.loads(out.read_text(encoding="utf-8"))
    root, by_id = (folder / content["info"]["root"]).resolve(), dict[int, Picture]()
    for image in content["images"]:
        file = {"file": str(root / image["file_name"]), "frame": image["frame"]}
        by_id[image["id"]] = {**file, "boxes": [], "ignored": []}
    for person in content["annotations"]:
        by_id[person["image_id"]]["ignored" if person["iscrowd"] else "boxes"].append(person["bbox"])
    return list(by_id.values())


def real_pictures(data: Path, folder: Path) -> dict[int, Picture]:
    """Returns the pictures of PETS09-S2L1 by frame; the person without labels is ignored."""
    found = {one["frame"]: one for one in labelled_pictures(data / PETS, folder)}
    for frame in range(int(UNLABELLED[0, 0]), int(UNLABELLED[-1, 0]) + 1):
        found[frame]["ignored"] = [[float(np.interp(frame, UNLABELLED[:, 0], side)) for side in UNLABELLED.T[1:]]]
    return found


def synthetic_pictures(suite: str, seeds: range, sets: list[str], folder: Path) -> list[Picture]:
    """Returns the pictures of every 50th frame of a suite or scenario."""
    words = ["--no-background", "--stride", "50", *(word for one in sets for word in ("--set", one))]
    out = folder / Path(suite).stem
    GenerateRun([suite], seeds_text(seeds), streams="left", more=words).finish(out)
    return [one for one in labelled_pictures(next(out.glob("flockscope-*")), folder) if one["boxes"]]


def training_sets(
    real: dict[int, Picture], synthetic: dict[str, list[Picture]], count: int, seed: int
) -> dict[str, list[list[Picture]]]:
    """Returns the sets of pictures that each row of the table trains on."""
    r = np.random.default_rng([seed, 71])
    few, many = ([real[k] for k in r.choice(TRAIN, n, replace=False)] for n in (FEW, MANY))
    found = {f"{FEW} real": [few], f"{MANY} real": [many]}
    for name, pictures in synthetic.items():
        some = [pictures[k] for k in r.permutation(len(pictures))[:count]]
        found |= {f"{len(some)} of {name}": [some], f"{FEW} real, {len(some)} of {name}": [few, some]}
    return found


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--peer-python", required=True, help="interpreter with torch, opencv-python-headless < 5")
    parser.add_argument("--from", nargs="+", default=["standard"], metavar="SUITE", dest="suites", help="or scenarios")
    parser.add_argument("--set", action="append", default=[], metavar="K=V", help="as of generate")
    parser.add_argument("--pictures", type=int, default=200, metavar="N", help="at most so many of each suite")
    parser.add_argument("--draws", type=int, default=3, metavar="N", help="of the training pictures")
    parser.add_argument("--detectors", nargs="+", default=["hog", "cnn"], choices=["hog", "cnn"])
    add_seeds(parser, "0:3", what="of the suites: ")
    add_data(parser)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        real = real_pictures(args.data, folder)
        synthetic = {s: synthetic_pictures(s, args.seeds, args.set, folder) for s in args.suites}
        draws = [training_sets(real, synthetic, args.pictures, seed) for seed in range(args.draws)]
        test = [real[k] for k in TEST]
        truth, ignored = ([np.reshape(one[key], (-1, 4)) for one in test] for key in ("boxes", "ignored"))
        head(["trained on", *(f"{name}, AP" for name in args.detectors)])
        for name in draws[0]:
            sets = [draw[name] for draw in draws]
            jobs = [{"detector": d, "seed": k, "sets": one} for d in args.detectors for k, one in enumerate(sets)]
            given, out = folder / "jobs.json", folder / "found.npz"
            given.write_text(json.dumps({"test": [one["file"] for one in test], "jobs": jobs}))
            subprocess.run([args.peer_python, RUNNER, given, out], check=True)
            with np.load(out) as found:
                values = np.array([average_precision(truth, ignored, found[str(k)]) for k in range(len(jobs))])
            row([name, *map(mean_cell, values.reshape(len(args.detectors), -1))])


if __name__ == "__main__":
    main()
