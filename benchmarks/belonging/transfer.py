"""Modes `transfer` and `giveaway` of `benchmarks.belonging`: classifiers of pairs, fitted by scikit-learn elsewhere.

benchmarks/peers/classify_pairs.py fits and predicts in an environment of its own. The scores are made here.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.belonging.pair_features import ARRIVAL, FAMILIES, NAMES
from benchmarks.belonging.sources import FPS, Source, read
from benchmarks.support.tables import interval, number, table
from sim.types import Array, Bools, Ints
from tracking.stats import block_intervals

RUNNER = Path(__file__).parents[1] / "peers" / "classify_pairs.py"
COLUMNS = {family: [k for k, name in enumerate(NAMES) if name.split(",")[0] == family] for family in FAMILIES + ARRIVAL}
"""Family of features → its columns."""
ALL = list(range(len(NAMES)))
AVERAGED = [k for family in FAMILIES for k in COLUMNS[family]]
PORTION = 50  # draws of weights that are scored together: bounds memory
Job = Mapping[str, object]


def classify(python: str, folder: Path, jobs: Sequence[Job]) -> list[dict[str, np.ndarray]]:
    """Returns the answer to each job of benchmarks/peers/classify_pairs.py. Raises CalledProcessError if it fails."""
    with tempfile.TemporaryDirectory() as scratch:
        given, out = Path(scratch, "jobs.json"), Path(scratch, "out.npz")
        given.write_text(json.dumps({"folder": str(folder.resolve()), "jobs": jobs}))
        subprocess.run([python, str(RUNNER), str(given), str(out)], check=True)
        with np.load(out) as file:
            answers: list[dict[str, np.ndarray]] = [{} for _ in jobs]
            for key in file.files:
                k, name = key.split("/", 1)
                answers[int(k)][name] = file[key]
    return answers


def f1(weight: Array, frame: Ints, true: Bools, found: Bools) -> Array:
    """Returns the pairwise F1 of each row of weights (D, frames), (D,); rows of pairs: frame (from 0), true, found."""
    count = [np.bincount(frame[rows], minlength=weight.shape[1]) for rows in (true & found, true, found)]
    hits, positives, reported = (weight @ c for c in count)
    return np.asarray(2 * hits / np.maximum(positives + reported, 1e-9))


def average_precision(weight: Array, frame: Ints, true: Bools, p: Array) -> Array:
    """Returns the average precision of each row of weights (D, frames), (D,), with ties as one step; nan: none true."""
    order = np.argsort(-p, kind="stable")
    last = np.append(p[order][:-1] != p[order][1:], True)
    out = []
    for low in range(0, len(weight), PORTION):
        w = weight[low : low + PORTION][:, frame[order]]
        hits, found = (np.cumsum(x, axis=1)[:, last] for x in (w * true[order], w))
        gain = np.diff(hits, axis=1, prepend=0.0)
        with np.errstate(invalid="ignore"):
            out.append((gain * hits / np.maximum(found, 1e-9)).sum(axis=1) / hits[:, -1])
    return np.concatenate(out)


def cells(source: Source, p: Array, threshold: float) -> list[str]:
    """Returns F1 at 0.5, F1 at the threshold and average precision, with 95 % intervals, of a recording."""
    frame = source.pair_frame - 1

    def scores(weight: Array) -> Array:
        found = [f1(weight, frame, source.mates, p >= at) for at in (0.5, threshold)]
        return np.column_stack([*found, average_precision(weight, frame, source.mates, p)])

    ends = block_intervals(scores, int(source.length[0]), FPS, scales=("share",) * 3)
    return [interval(*map(float, values)) for values in zip(*ends, strict=True)]


def transfer(folder: Path, train: Sequence[str], recordings: Sequence[str], python: str) -> None:
    sources = {name: read(folder, name) for name in recordings}
    trained = [*(text.split("+") for text in train), *([name] for name in recordings)]
    models = {"logistic": AVERAGED, "boosted": ALL}
    jobs = [_job(model, names, recordings, columns) for names in trained for model, columns in models.items()]
    less = [
        {**_job("boosted", names, recordings, [k for k in ALL if k not in COLUMNS[family]]), "threshold": False}
        for names in trained for family in COLUMNS
    ]  # fmt: skip
    answers = classify(python, folder, [*jobs, *less])
    scores = ("F1 at 0.5", "F1 at the best threshold", "average precision", "threshold")
    for test, source in sources.items():
        rows = {}
        for job, answer in zip(jobs, answers, strict=False):
            threshold = float(answer["threshold"])
            name = f"{job['model']}, {_named(job, test)}"
            rows[name] = [*cells(source, answer[test], threshold), number(threshold, 2)]
        table(f"mates of {test}", "trained on", scores, rows)
    for test, source in sources.items():
        weight, frame = np.ones((1, int(source.length[0]))), source.pair_frame - 1
        at_half = [float(f1(weight, frame, source.mates, a[test] >= 0.5)[0]) for a in answers]
        full = at_half[1 : len(jobs) : 2]
        part = np.reshape(at_half[len(jobs) :], (len(trained), len(COLUMNS)))
        rows = {
            _named(job, test): [number(all, 2), *(f"{x - all:+.2f}" for x in without)]
            for job, all, without in zip(jobs[1::2], full, part, strict=True)
        }
        table(f"mates of {test}, boosted: F1 at 0.5, and its change without", "trained on", ["all", *COLUMNS], rows)


def _job(model: str, train: Sequence[str], test: Sequence[str], columns: Sequence[int]) -> Job:
    given = {"train": list(train), "test": list(test), "columns": list(columns)}
    return {"kind": "mates", "model": model, "threshold": True, **given}


def _named(job: Job, test: str) -> str:
    return "itself, held out" if job["train"] == [test] else "+".join(map(str, job["train"]))  # type: ignore[call-overload]


def giveaway(folder: Path, scenes: Sequence[str], recordings: Sequence[str], python: str) -> None:
    first, *others = recordings
    compared = [*((real, made) for made in scenes for real in recordings), *((first, other) for other in others)]
    families = list(COLUMNS.values())
    for mates in (False, True):
        jobs = [
            {"kind": "origin", "real": real, "made": made, "mates": mates, "families": families}
            for real, made in compared
        ]
        rows = {
            f"{made} / {real}": [number(float(a["area"]), 2), *(f"{x:.2f}" for x in a["lost"])]
            for (real, made), a in zip(compared, classify(python, folder, jobs), strict=True)
        }
        who = "mates" if mates else "strangers"
        table(f"{who}: area under the ROC curve, and loss by shuffled", "sources", ["area", *COLUMNS], rows)
