"""Decisions of `stereo`, each switched off: paired differences to the defaults.

`ABLATIONS` are decisions that have a parameter. `RULES` have none, so that code of the tracker is replaced: `mean in
space` measures the mean of the points' (u, v, d); `expected places` puts hulls round the measured places of points;
`settled` counts merges of groups that were there for less than 1 s; `P of a mean` gives a merged group the P of its
largest part; `least density` takes densities of features as they are; `half a footprint` gives a feature a whole one.
`LIGHT` is for the scene light and run by --options only. With --store, rows of earlier runs count, too, so that
decisions may have different numbers of sequences.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping

import numpy as np

from benchmarks.stereo.scenes import Variant, measured
from benchmarks.stereo.stored_rows import Row
from benchmarks.support.tables import signed, table
from sim.scene.camera import back_project, project_pair
from sim.types import Array
from tracking.detect.features import SpacePoints
from tracking.papers.stereo import group_life, points, space_group, tracker
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.space_group import PairMeasurement
from tracking.stats import mean_interval

ABLATIONS: Mapping[str, Mapping[str, object]] = {
    "surface_offset": {"surface_offset": 0.0},
    "density_width": {"density_width": 20.0},
    "point_covariance": {"point_covariance": False},
    "velocity_weight": {"velocity_weight": 0.0},
    "spread_weight": {"spread_weight": 0.1},
    "split": {"split": False},
    "split_time": {"split_time": 0.0},
    "confirm_time": {"confirm_time": 0.0},
    "centroid_noise": {"centroid_noise": 0.005},
    "coast_time": {"coast_time": 10.0, "report_coast": 5.0},
}


def _mean_in_the_image(points: SpacePoints, pair: PairMeasurement, config: StereoConfig) -> tuple[Array, Array]:
    """Returns the place (3,), m, whose (u, v, d) are the means of those of the points, and the tracker's weights."""
    weights = pair.weights(points, config.density_width)
    weights = weights / weights.sum()
    mean = weights @ project_pair(pair.camera, points.pos)
    return np.asarray(back_project(pair.camera, mean[None])[0]), weights


def _measured_places(offset: Array, cov: Array, spread: Array) -> Array:
    del cov, spread
    return offset


LIGHT: Mapping[str, Mapping[str, object]] = {"adaptive background": {"background": "trained"}}


def _largest_part(n: Array, P: Array) -> Array:
    return P[n.argmax()]


RULES: Mapping[str, tuple[object, str, object]] = {
    "mean in space": (space_group, "mean_position", _mean_in_the_image),
    "expected places": (space_group, "expected_places", _measured_places),
    "settled": (group_life, "SETTLED", 0.0),
    "P of a mean": (group_life, "covariance_of_mean", _largest_part),
    "least density": (space_group, "LEAST_DENSITY", 0.0),
    "person or not": (points, "PERSON", (0.0, 10.0, 0.0)),
    "half a footprint": (tracker, "FEATURE_OUTLINE", 1.0),
}
"""Owner, name and replacement by the name of the row."""
VARIANTS: Mapping[str, Variant] = {
    **{name: Variant(name, params) for name, params in {**ABLATIONS, **LIGHT}.items()},
    **{name: Variant(name, replaced=(change,)) for name, change in RULES.items()},
}
"""The tracker without a decision, by the name of the row."""


def decisions(args: argparse.Namespace) -> dict[str, dict[str, dict[int, Row]]]:
    """Prints, for each decision switched off, the paired difference over all scenes, and returns the rows."""
    wanted = [*ABLATIONS, *RULES] if args.options is None else args.options.split(",")
    made = measured(args, (Variant("stereo"), *(VARIANTS[name] for name in wanted)))
    rows = {}
    for name in wanted:
        cells = [str(sum(len(by[name]) for by in made.values()))]
        for key in ("group_F1_hull", "group_MOTA", "error", "extra"):
            off = [
                row.get(key, np.nan) - by["stereo"][s].get(key, np.nan)
                for by in made.values()
                for s, row in by[name].items()
            ]
            cells.append(signed(*map(float, mean_interval(np.array(off)))))
        rows[name] = cells
    columns = ("sequences", "group F1", "MOTA", "error, m", "extra")
    table("Each decision switched off: difference to the defaults", "decision", columns, rows)
    return made
