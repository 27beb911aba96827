"""What drives the position error? The tracker with true disparities, and with people that count alike.

`true disparities`: each pixel of a person has its true disparity instead of the matcher's. `people alike`: in a group's
mean each feature counts by the inverse of the number of features on its true person, instead of the inverse of their
density on the ground; features on no person do not count unless there are no others. Both use the truth, so that no
tracker can have them. The columns are those of the mode `scenes`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from unittest import mock

import numpy as np

from benchmarks.stereo.scenes import Variant, entries, row_of
from benchmarks.stereo.stored_rows import Row, Stored
from benchmarks.support.in_memory import in_memory
from benchmarks.support.tables import interval, number, table
from scenarios.loading.resolve import Entry
from sim.sequence import simulate
from sim.types import Array, Image, PixelTruth
from sim.types import Sequence as Recording
from tracking.detect.features import Features, SpacePoints
from tracking.detect.subtraction_stereo import Matched, SubtractionStereo
from tracking.papers.stereo.measurement import PairMeasurement
from tracking.papers.stereo.picture_points import PicturePoints
from tracking.stats import mean_interval

VARIANTS = {
    "the tracker": (False, False), "true disparities": (True, False), "people alike": (False, True),
    "both": (True, True),
}  # fmt: skip
"""True disparities?, people alike?"""


def causes(args: argparse.Namespace) -> dict[str, list[str]]:
    """Prints the table and returns its rows."""
    stored, rows = Stored(args.store), {}
    for name, entry in entries(args.only).items():
        for seed in args.seeds:
            if all(stored.has(name, v, seed) for v in VARIANTS):
                continue
            sequence = _recording(entry, seed)
            for variant, (disparities, alike) in VARIANTS.items():
                with helped_by_truth(sequence, disparities, alike):
                    stored.add(name, variant, seed, row_of(sequence, Variant("stereo")))
            stored.write()
            print(f"{name} {seed}", file=sys.stderr, flush=True)
        for variant in VARIANTS:
            rows[f"{name}, {variant}"] = _cells(list(stored.rows(name, variant).values()))
    table("Causes of the position error", "scene", ("error, m", "± sd", "along", "± sd", "across ± sd"), rows)
    return rows


def _recording(entry: Entry, seed: int) -> Recording:
    return in_memory(simulate(entry.scenario, seed, entry.repeat, streams=("left", "right", "disparity")))


def _cells(rows: list[Row]) -> list[str]:
    others = [number(float(np.mean([r[k] for r in rows]))) for k in ("sd", "along", "along sd", "across sd")]
    return [interval(*map(float, mean_interval(np.array([r["error"] for r in rows])))), *others]


@contextmanager
def helped_by_truth(sequence: Recording, disparities: bool, alike: bool) -> Iterator[None]:
    """Gives the tracker true disparities, or weights by true people, in one run over the sequence."""
    frames, person = count(1), dict[int, int]()
    match, step, weights = SubtractionStereo.match, Features.step, PairMeasurement.weights
    points_of = PicturePoints.points
    truth: PixelTruth | None = None

    def seen(self: PicturePoints, image: Image, right: Image) -> SpacePoints | None:
        nonlocal truth
        here = sequence.frame_truth(next(frames))
        assert here is not None
        truth = here.pixels
        return points_of(self, image, right)

    def matched(self: SubtractionStereo, left: Image, right: Image, mask: Array) -> Matched:
        found = match(self, left, right, mask)
        if not disparities:
            return found
        assert truth is not None
        assert truth.disparity is not None
        known = mask & (truth.ids > 0) & np.isfinite(truth.disparity)
        return replace(found, disparity=np.where(known, truth.disparity, found.disparity).astype(np.float32))

    def stepped(self: Features, *given: object) -> SpacePoints:
        points = step(self, *given)  # type: ignore[arg-type]
        assert truth is not None
        u, v = np.floor(self.uv).astype(int).T
        person.clear()
        person.update(zip(self.id.tolist(), truth.ids[v, u].tolist(), strict=True))
        return points

    def weighed(self: PairMeasurement, points: SpacePoints, width: float) -> Array:
        own = np.array([person[k] for k in points.id.tolist()])
        if not alike or not (own > 0).any():
            return weights(self, points, width)
        _, of, many = np.unique(own, return_inverse=True, return_counts=True)
        return np.where(own > 0, 1.0 / many[of], 0.0)

    with (
        mock.patch.object(PicturePoints, "points", seen),
        mock.patch.object(SubtractionStereo, "match", matched),
        mock.patch.object(Features, "step", stepped),
        mock.patch.object(PairMeasurement, "weights", weighed),
    ):
        yield
