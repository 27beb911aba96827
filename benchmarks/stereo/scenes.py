"""The paper's scenes (sec. 4, Table 1) for `stereo`: position errors of groups, group scores, events.

A true group with two members or more, at most 8 m deep, is compared with the nearest reported group if that is at most
1.5 m away. `error`: mean distance of centroids on the ground, and standard deviation, as in Table 1; `along`: mean and
standard deviation of the error along the horizontal line of sight, positive away from the camera; `across`: standard
deviation of the error across it. `found`: share of those true groups that have a reported group so near. The mean is
over frames, and then over sequences. `group F1`, `merge F1`: of the catalogue; `extra`: number of reported
merges and splits of a sequence above that of the true ones; `enters`: false enter events of a sequence. 95 % intervals
over sequences are Student's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from benchmarks.stereo.further_scenes import further_entries
from benchmarks.stereo.kept_points import shared_points
from benchmarks.stereo.stored_rows import Row, Stored
from benchmarks.support.in_memory import in_memory
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import interval, number, table
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, resolve
from sim.sequence import simulate
from sim.types import DetectionMode, Tracks
from sim.types import Sequence as Recording
from tracking.papers.stereo.config import StereoConfig
from tracking.running.run import TrackingRun, track
from tracking.scoring import evaluate
from tracking.stats import mean_interval

SUITE, DEEPEST, NEAR = "subtraction-stereo", 8.0, 1.5
PAPER = {"cross": "0.119 ± 0.077", "stairs": "0.105 ± 0.076"}
"""Table 1: average error and standard deviation, m."""
COLUMNS = (
    "error, m", "± sd", "paper", "along", "± sd", "across ± sd", "found", "group F1", "merge F1", "extra",
    "enters", "frames/s",
)  # fmt: skip


@dataclass(frozen=True)
class Variant:
    """A set of parameters with a name.

    replaced: attributes of the tracker's code that are replaced while it runs: owner, name, value. They must not change
    points, which variants share.
    """

    name: str
    params: Mapping[str, object] = field(default_factory=dict)
    replaced: tuple[Replacement, ...] = ()


def entries(only: str | None) -> dict[str, Entry]:
    """Returns the scenes of the suite by name, without its prefix; only: names of these or of the further scenes,
    separated by commas."""
    found = {e.name.removeprefix("stereo-"): e for e in resolve(SUITE)}
    if only is None:
        return found
    every = {**found, **further_entries()}
    return {name: every[name] for name in every if name in set(only.split(","))}


def recordings(entry: Entry, seeds: Iterable[int]) -> Iterator[tuple[int, Recording]]:
    """Yields the pairs of pictures of each seed, kept in memory; a seed that cannot be simulated is printed and left
    out."""
    for seed in seeds:
        try:
            live = simulate(entry.scenario, seed, entry.repeat, streams=("left", "right"))
            assert live.truth is not None
        except FlockscopeError as error:
            print(f"{entry.name}, seed {seed}, left out: {error.line()}", file=sys.stderr)
            continue
        yield seed, in_memory(live)


def tracked(sequence: Recording, variant: Variant, detections: DetectionMode) -> TrackingRun:
    """Returns the tracks of one sequence by a variant."""
    with replaced_code(variant.replaced):
        return track("stereo", sequence, params=variant.params or None, detections=detections)


def row_of(sequence: Recording, variant: Variant) -> Row:
    """Returns position errors and scores of one sequence."""
    run = tracked(sequence, variant, "image")
    truth = sequence.truth
    assert truth is not None
    scores = evaluate(truth, run)
    kinds = [e.kind for t in run for e in t.events]
    true = [e.kind for e in truth.events or ()]
    extra = sum(max(kinds.count(kind) - true.count(kind), 0) for kind in ("merge", "split"))
    own = {"extra": float(extra), "frames/s": float(run.info["frames_per_second"])}
    return {**position_errors(sequence, run), **scores, **own}


def position_errors(sequence: Recording, tracks: object) -> Row:
    """Returns mean and standard deviation of the errors of group positions of one sequence, nan without any."""
    truth, camera = sequence.truth, sequence.camera
    assert truth is not None
    assert truth.groups is not None
    assert camera is not None
    found, seen = [], 0
    for t in tracks:  # type: ignore[attr-defined]
        found_here = _errors_of_frame(t, truth.groups[t.index - 1], camera)
        seen += len(found_here)
        found += [e for e in found_here if e is not None]
    e = np.array(found).reshape(-1, 2)
    size = np.linalg.norm(e, axis=1)
    keys = ("error", "sd", "along", "along sd", "across sd")
    values = (size.mean(), size.std(), e[:, 0].mean(), e[:, 0].std(), e[:, 1].std()) if len(e) else [np.nan] * 5
    return {**dict(zip(keys, map(float, values), strict=True)), "found": len(e) / seen if seen else np.nan}


def _errors_of_frame(t: Tracks, groups: object, camera: object) -> list[np.ndarray | None]:
    """Returns the error along and across the line of sight of each true group of a frame; None for one not found."""
    made: list[np.ndarray | None] = []
    for pos, members in zip(groups.pos, groups.members, strict=True):  # type: ignore[attr-defined]
        depth = (np.append(pos, 1.0) - camera.position) @ camera.rotation[2]  # type: ignore[attr-defined]
        if len(members) < 2 or depth > DEEPEST:
            continue
        away = t.groups.pos[:, :2] - pos  # type: ignore[union-attr]
        k = np.linalg.norm(away, axis=1).argmin() if len(away) else -1
        if k < 0 or np.linalg.norm(away[k]) > NEAR:
            made.append(None)
            continue
        sight = pos - camera.position[:2]  # type: ignore[attr-defined]
        sight = sight / np.linalg.norm(sight)
        made.append(np.array([away[k] @ sight, away[k] @ [-sight[1], sight[0]]]))
    return made


def measured(args: argparse.Namespace, variants: tuple[Variant, ...]) -> dict[str, dict[str, dict[int, Row]]]:
    """Returns the rows by scene, variant and seed. Rows of earlier runs in the file args.store are kept, and new ones
    are added to it after each sequence."""
    made: dict[str, dict[str, dict[int, Row]]] = {}
    stored = Stored(args.store)
    for name, entry in entries(args.only).items():
        made[name] = {v.name: {} for v in variants}
        missing = [s for s in args.seeds if not all(stored.has(name, v.name, s) for v in variants)]
        for seed, sequence in recordings(entry, missing):
            with shared_points():
                for v in variants:
                    if not stored.has(name, v.name, seed):
                        stored.add(name, v.name, seed, row_of(sequence, v))
            stored.write()
            print(f"{name} {seed}", file=sys.stderr, flush=True)
        for v in variants:
            made[name][v.name] = stored.rows(name, v.name)
    return made


def scenes(args: argparse.Namespace) -> dict[str, dict[str, dict[int, Row]]]:
    """Prints the table of scenes, for the defaults and the preset `paper`, and returns the rows."""
    variants = (Variant("stereo"), Variant("preset paper", StereoConfig.preset("paper").as_dict()))
    if args.options is not None:
        variants = tuple(v for v in variants if v.name in args.options.split(","))
    made = measured(args, variants)
    rows = {f"{name}, {v}": _cells(name, list(of.values())) for name, by in made.items() for v, of in by.items()}
    table("Scenes of the paper", "scene", COLUMNS, rows)
    return made


def _cells(name: str, rows: list[Row]) -> list[str]:
    def mean(key: str, digits: int = 3) -> str:
        values = np.array([r.get(key, np.nan) for r in rows])
        return number(float(np.nanmean(values)), digits) if np.isfinite(values).any() else "–"

    def with_interval(key: str) -> str:
        return interval(*map(float, mean_interval(np.array([r.get(key, np.nan) for r in rows]))))

    return [
        with_interval("error"), mean("sd"), PAPER.get(name, "–"), mean("along"), mean("along sd"), mean("across sd"),
        mean("found"), with_interval("group_F1_hull"), mean("merge_F1"), mean("extra", 2), mean("enter_FP", 1),
        mean("frames/s", 0),
    ]  # fmt: skip
