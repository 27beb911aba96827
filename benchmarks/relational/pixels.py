"""`relational` from pictures: what dividing blobs and its constants are worth; and from measured boxes."""

from __future__ import annotations

import argparse
import warnings
from unittest.mock import patch

import numpy as np

import tracking
from benchmarks.relational.errors import config_of
from benchmarks.relational.groups import differences
from benchmarks.support import tables
from benchmarks.support.options import CAMPUS, PETS
from scenarios.loading.resolve import resolve
from sim.io.source import open_source
from sim.sequence import simulate
from tracking.detect import divided_blobs
from tracking.prepare import prepare

SETTINGS = (
    "", "pixel_noise=0.08", "pixel_noise=0.3", "FEWEST=0", "FEWEST=0.5", "MOST=0.5", "MOST=1", "LEAST=0",
    "LEAST=0.5",
)  # fmt: skip
"""Parameters in small letters; constants of tracking.detect.divided_blobs in capitals."""
COLUMNS = ("HOTA", "DetA", "AssA", "IDF1")


def scores(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings, and `blob`; columns mean scores of boxes."""
    warnings.simplefilter("ignore")
    rows: dict[str, list[list[float]]] = {name: [] for name in ("blob", *SETTINGS)}
    for entry in (e for e in resolve(f"suite:{given.suite}") if not given.entry or e.name in given.entry.split(",")):
        for seed in given.seeds:
            sequence = simulate(entry.scenario, seed, 0, ("left",))
            frames = list(prepare("blob", sequence, detections="image").frames())
            for name, found in rows.items():
                constants = {k: float(v) for k, _, v in (x.partition("=") for x in name.split()) if k.isupper()}
                own = [x for x in name.split() if x.partition("=")[0].islower() and "=" in x]
                config = None if name == "blob" else config_of("relational", given.counts[0], given).with_set(*own)
                with patch.dict(vars(divided_blobs), constants):
                    tracker = "blob" if name == "blob" else "relational"
                    ready = prepare(tracker, sequence, params=config, detections="image")
                    ready.reset(seed)
                    tracks = [ready.step(frame) for frame in frames]
                scored = tracking.evaluate(sequence.truth, tracks, similarity="boxes")
                found.append([scored[key] for key in COLUMNS])
    count = len(rows["blob"])
    print(f"\nsuite {given.suite}, {count} sequences, {given.counts[0]} particles\n")
    tables.head(["setting", *COLUMNS])
    for name, found in rows.items():
        tables.row([name or "defaults", *(f"{x:.3f}" for x in np.nanmean(np.array(found), axis=0))])


def boxes(given: argparse.Namespace) -> None:
    """Prints a table: rows are recordings and trackers, columns scores from the boxes of the recording's detector; the
    last row of a recording has the differences of both filters, paired by seed."""
    warnings.simplefilter("ignore")
    names = (*COLUMNS, "MOTA")
    tables.head(["recording", "tracker", *names])
    for path in (PETS, CAMPUS):
        (sequence,) = open_source(given.recordings / path, images=False)
        found = {}
        for name in ("blob", "particle", "relational"):
            runs = []
            for seed in given.seeds if name != "blob" else given.seeds[:1]:
                config = None if name == "blob" else config_of(name, given.counts[0], given)
                ready = prepare(name, sequence, params=config, detections="file")
                ready.reset(seed)
                tracks = [ready.step(frame) for frame in ready.frames()]
                scored = tracking.evaluate(sequence.truth, tracks, similarity="boxes")
                runs.append([scored[key] for key in names])
            found[name] = np.array(runs)
            tables.row([path, name, *(f"{x:.3f}" for x in found[name].mean(axis=0))])
        tables.row([path, "relational − particle", *differences(found["particle"], found["relational"])])
