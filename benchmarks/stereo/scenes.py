"""The paper's scenes (sec. 4, Table 1) for `stereo` and its preset `paper`; then its decisions, each switched off: from
pictures in these scenes, from points on the suite standard (the first seed).

A true group with two members or more is compared with the nearest reported group, if that is at most 1.5 m away on the
ground; `found`: share of those true groups that have one. A true group's height is the mean of its members' body
middles. Errors are mean distances, with the standard deviation, of groups at most 8 m deep:

ground            on the ground plane
3-D, offset       in space, after the mean difference of height in the sequence is taken off
3-D, seen side    as 3-D, offset, to the side of bodies that the camera sees: 0.12 m nearer than their middle
3-D, middle       in space, to the middle of bodies
3-D, all depths   as 3-D, offset, of groups at any depth
along             mean error along the horizontal line of sight, positive away from the camera

The mean is over the frames of all sequences, and so is that of the deviations in each. The preset has the spheres of
the paper's scene. `group F1`, `merge F1`: of the catalogue; `extra`: number of reported merges and splits of a sequence
above that of the true ones. 95 % intervals over sequences are Student's.

`VARIANTS` and `FROM_POINTS` switch decisions off. Those without a parameter replace code of the tracker. Differences
are paired, over the same sequences.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.stereo.kept_points import shared_points
from benchmarks.support.in_memory import in_memory
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, mean_cell, number, table
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, resolve
from sim.sequence import simulate
from sim.types import Array, DetectionMode, Tracks
from sim.types import Sequence as Recording
from tracking.papers.stereo import space_group, tracker
from tracking.papers.stereo.config import StereoConfig
from tracking.running.run import track
from tracking.scoring import evaluate

Row = dict[str, float]
DEEPEST, NEAR = 8.0, 1.5  # m
SEEN_SIDE = 0.12  # m: mean depth of an ellipsoid's side before its middle, 2/3 of the mean half axis of bodies
SCENES = ("cross", "merge", "stairs")
SPHERES = {"stairs": 0.5}  # m; 1.0 in the others, as in the preset
# Table 1: average error and standard deviation, m.
PRINTED = {"cross": "0.119 ± 0.077", "stairs": "0.105 ± 0.076"}


@dataclass(frozen=True)
class Variant:
    """A set of parameters; replaced: attributes of the tracker's code that are replaced while it runs: owner, name,
    value. They must not change points, which variants share."""

    params: Mapping[str, object] = field(default_factory=dict)
    replaced: tuple[Replacement, ...] = ()


def _measured_places(offset: Array, cov: Array, spread: Array) -> Array:
    del cov, spread
    return offset


VARIANTS: Mapping[str, Variant] = {
    "surface_offset": Variant({"surface_offset": 0.0}),
    "top_offset": Variant({"top_offset": 0.0}),
    "density_width": Variant({"density_width": 20.0}),
    "point_covariance": Variant({"point_covariance": False}),
    "expected places": Variant(replaced=((space_group, "expected_places", _measured_places),)),
    "half a footprint": Variant(replaced=((tracker, "FEATURE_OUTLINE", 1.0),)),
}
# Decisions that pictures of so few sequences cannot judge: from the simulated detector, on the suite standard.
FROM_POINTS: Mapping[str, Variant] = {
    "spread_weight": Variant({"spread_weight": 0.1}),
    "no splits": Variant({"split_time": 100.0}),
    "splits at once": Variant({"split_time": 0.0}),
    "confirm_time": Variant({"confirm_time": 0.0}),
}


def recordings(entry: Entry, seeds: Iterable[int], streams: tuple[str, ...] = ("left", "right")) -> Iterator[Recording]:
    """Yields the sequence of each seed with its pictures in memory; a seed that cannot be simulated is printed and left
    out."""
    for seed in seeds:
        try:
            live = simulate(entry.scenario, seed, entry.repeat, streams=streams)
            assert live.truth is not None
        except FlockscopeError as error:
            print(f"{entry.name}, seed {seed}, left out: {error.line()}", file=sys.stderr)
            continue
        yield in_memory(live, with_background=bool(streams))


def entries() -> dict[str, Entry]:
    """Returns the scenes of the suite by name, without its prefix."""
    return {e.name.removeprefix("stereo-"): e for e in resolve("subtraction-stereo")}


def row_of(sequence: Recording, variant: Variant, detections: DetectionMode = "image") -> Row:
    """Returns position errors and scores of one sequence."""
    with replaced_code(variant.replaced):
        run = track("stereo", sequence, params=variant.params or None, detections=detections)
    truth = sequence.truth
    assert truth is not None
    kinds, true = [e.kind for t in run for e in t.events], [e.kind for e in truth.events or ()]
    extra = sum(max(kinds.count(kind) - true.count(kind), 0) for kind in ("merge", "split"))
    return {**position_errors(sequence, run), **evaluate(truth, run), "extra": float(extra)}


def position_errors(sequence: Recording, tracks: Iterable[Tracks]) -> Row:
    """Returns the errors of group positions of one sequence, nan without any, or without heights."""
    truth, camera = sequence.truth, sequence.camera
    assert truth is not None
    assert truth.groups is not None
    assert camera is not None
    assert truth.z is not None
    assert truth.height is not None
    keys = zip(truth.frame.tolist(), truth.id.tolist(), strict=True)
    middle = dict(zip(keys, (truth.z + truth.height / 2).tolist(), strict=True))
    rows = []  # depth; error along, across, up
    for t in tracks:
        groups = truth.groups[t.index - 1]
        assert t.groups is not None
        for pos, members in zip(groups.pos, groups.members, strict=True):
            if len(members) < 2:
                continue
            z = np.mean([middle[t.index, k] for k in members.tolist()])
            depth = (np.append(pos, z) - camera.position) @ camera.rotation[2]
            away = t.groups.pos[:, :2] - pos
            k = np.linalg.norm(away, axis=1).argmin() if len(away) else -1
            if k < 0 or np.linalg.norm(away[k]) > NEAR:
                rows.append([depth, np.nan, np.nan, np.nan])
                continue
            sight = (pos - camera.position[:2]) / np.linalg.norm(pos - camera.position[:2])
            up = t.groups.pos[k, 2] - z if t.plane == "space" else np.nan
            rows.append([depth, away[k] @ sight, away[k] @ [-sight[1], sight[0]], up])
    return _errors(np.array(rows).reshape(-1, 4))


def _errors(rows: Array) -> Row:
    near = rows[rows[:, 0] <= DEEPEST]
    known, every = (part[~np.isnan(part[:, 1]), 1:] for part in (near, rows))
    made = {"found": len(known) / len(near) if len(near) else np.nan, "places": len(near)}
    made["known"] = len(known)
    for name, errors in {
        "ground": known[:, :2], "offset": _levelled(known), "seen side": _levelled(known + np.array([SEEN_SIDE, 0, 0])),
        "middle": known, "all depths": _levelled(every),
    }.items():  # fmt: skip
        size = np.linalg.norm(errors, axis=1) if len(errors) else np.full(1, np.nan)
        made |= {name: float(size.mean()), f"{name} sd": float(size.std())}
    return made | {"along": float(known[:, 0].mean()) if len(known) else np.nan}


def _levelled(errors: Array) -> Array:
    return errors - [0.0, 0.0, errors[:, 2].mean()] if len(errors) else errors


def scenes(args: argparse.Namespace) -> dict[str, dict[str, list[Row]]]:
    """Prints the table of scenes and that of decisions, and returns the rows by scene and variant."""
    preset = StereoConfig.load("paper")
    made: dict[str, dict[str, list[Row]]] = {}
    for scene in SCENES:
        paper = replace(preset, radius=SPHERES.get(scene, preset.radius))
        variants = {"default": Variant(), "paper": Variant(paper.as_dict()), **VARIANTS}
        by = made.setdefault(scene, {name: [] for name in variants})
        for sequence in recordings(entries()[scene], args.seeds):
            with shared_points():
                for name, variant in variants.items():
                    by[name].append(row_of(sequence, variant))
            print(f"{scene} {len(by['default'])}", file=sys.stderr, flush=True)
    columns = (
        "printed, m", "ground, m", "3-D, offset", "3-D, seen side", "3-D, middle", "3-D, all depths", "along", "found",
        "group F1", "merge F1", "extra",
    )  # fmt: skip
    rows = {f"{scene}, {name}": _cells(scene, made[scene][name]) for scene in SCENES for name in ("paper", "default")}
    table("Scenes of the paper: its preset, and the default", "scene", columns, rows)
    _switched_off("from pictures", made, VARIANTS, ("group F1", "MOTA", "ground, m", "3-D, middle", "extra"))
    made["points"] = {name: [] for name in ("default", *FROM_POINTS)}
    for entry in resolve("suite:standard"):
        for sequence in recordings(entry, args.seeds[:1], ()):
            for name, rows in made["points"].items():
                rows.append(row_of(sequence, FROM_POINTS.get(name, Variant()), "file"))
    _switched_off("from points", {"points": made["points"]}, FROM_POINTS, ("group F1", "MOTA", "extra"))
    return made


KEYS = {"group F1": "group_F1_hull", "MOTA": "group_MOTA", "ground, m": "ground", "3-D, middle": "middle",
        "extra": "extra"}  # fmt: skip


def _switched_off(
    source: str, made: Mapping[str, Mapping[str, list[Row]]], names: Iterable[str], columns: Sequence[str]
) -> None:
    off = {name: [_difference(made, name, KEYS[column]) for column in columns] for name in names}
    table(f"Each decision switched off, {source}: difference to the default", "decision", columns, off)


def _difference(made: Mapping[str, Mapping[str, list[Row]]], name: str, key: str) -> str:
    pairs = [pair for by in made.values() for pair in zip(by[name], by["default"], strict=True)]
    off = np.array([a.get(key, np.nan) - b.get(key, np.nan) for a, b in pairs])
    return difference_cell(off, key)


def _cells(scene: str, rows: list[Row]) -> list[str]:
    def mean(key: str, weight: str = "sequence") -> str:
        known = [r for r in rows if np.isfinite(r.get(key, np.nan))]
        weights = [r.get(weight, 1.0) for r in known]
        return number(float(np.average([r[key] for r in known], weights=weights)), 3) if known else "–"

    names = ("ground", "offset", "seen side", "middle", "all depths")
    errors = [f"{mean(key, 'known')} ± {mean(f'{key} sd', 'known')}" for key in names]
    f1 = mean_cell([r.get("group_F1_hull", np.nan) for r in rows])
    places = [mean("along", "known"), mean("found", "places")]
    return [PRINTED.get(scene, "–"), *errors, *places, f1, mean("merge_F1"), mean("extra")]
