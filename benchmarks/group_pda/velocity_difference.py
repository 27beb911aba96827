"""Mode `difference` of `benchmarks.group_pda`: ids kept against the difference of two groups' velocities.

pass-by: two groups walk in one direction on lanes 2.2 m apart, at 1.2 m/s plus and minus half the difference, and are
abreast in the middle of the recording. crossing: two groups walk at 1.2 m/s on paths that cross in the middle of the
recording at the angle theta; the difference is 2 · 1.2 sin(theta / 2), and at 0 they walk on lanes as above. One group
has 2 people, the other 2 or 3; they see and avoid each other. Each seed has one camera, which has everybody in view at
every difference, so that nothing but the difference varies.
Rows: share of encounters that keep both ids (all, and those that are true crossings: people may give way and not cross)
and share in which the tracker reports one group, by variant; share of true crossings; the measured difference while the
groups are near. The chart has a panel for each kind and input; the vertical line is `merge_velocity`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, cos, sin
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.group_pda.encounters import Encounter, GroupMatches, encounter_of
from benchmarks.group_pda.runs import Variant, tracked, trained_once
from benchmarks.support.chart import Panel, lines
from benchmarks.support.in_memory import in_memory
from benchmarks.support.options import seeds_text
from benchmarks.support.tables import share, table, wilson
from scenarios.schema.scenario import CameraSpec, Scenario
from sim.crowd.world import run as walk
from sim.scene.camera_placement import place_camera
from sim.sequence import observe
from sim.types import DetectionMode, Motion, Truth
from sim.workers.pool import process_pool
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.running import tracker_registry

DIFFERENCES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.6, 2.0)  # m/s
PACE = 1.2  # m/s
LANES = 2.2  # m between the lanes of groups that do not cross
SECONDS = {"pass-by": 12.0, "crossing": 20.0}
MIDDLE = (22.0, 22.0)  # m
START_SPREAD = 0.3  # m: greatest distance of a start from its nominal position, along x and y
OUT = Path("group-pda-difference.svg")

Outcomes = dict[str, list[dict[str, float]]]
"""By variant: one dict for each difference, with the keys kept, merged, apart, crossed."""


@dataclass(frozen=True)
class DifferenceJob:
    """One seed of one kind at all differences."""

    kind: str
    seed: int
    mode: DetectionMode
    differences: tuple[float, ...]
    variants: tuple[Variant, ...]


def script(kind: str, difference: float) -> Scenario:
    """Returns the scenario of a difference of velocities, m/s; its camera is placed for this very motion."""
    half = SECONDS[kind] / 2
    turn = asin(difference / 2 / PACE) if kind == "crossing" else 0.0
    side = LANES / 2 if turn == 0 else 0.0
    group = []
    for name, sign, size in (("a", 1.0, 2), ("b", -1.0, {"choice": [2, 3]})):
        speed = PACE + sign * difference / 2 if kind == "pass-by" else PACE
        way = np.array([cos(turn), sign * sin(turn)])
        x, y = np.array(MIDDLE) - [0.0, sign * side] - speed * half * way
        goal = np.array([x, y]) + 40.0 * way
        start = [{"uniform": [v - START_SPREAD, v + START_SPREAD]} for v in (x, y)]
        group.append(
            {"id": name, "size": size, "start": start, "goal": goal.tolist(), "speed": speed, "at_goal": "walk"}
        )
    return Scenario.model_validate(
        {
            "schema": 1, "name": kind, "duration": 2 * half, "mirror": True, "turn_deg": {"uniform": [-180, 180]},
            "world": {"size": [2 * v for v in MIDDLE]}, "group": group,
        }
    )  # fmt: skip


def one_camera(motions: Sequence[Motion]) -> CameraSpec:
    """Returns the camera that has everybody of every motion in view."""
    parts = ("pos", "vel", "heading", "present", "intent")
    beside = {name: np.concatenate([getattr(m, name) for m in motions], axis=1) for name in parts}
    bodies = {name: np.concatenate([getattr(m, name) for m in motions]) for name in ("height", "width", "depth")}
    camera = place_camera(CameraSpec(), motions[0].replace(**beside, **bodies))
    x, y, z = camera.position.tolist()
    return CameraSpec(position=(x, y), height=z)


def outcomes_of_job(job: DifferenceJob) -> Outcomes:
    """Tracks one seed at all differences.

    kept, merged, crossed: 0 or 1 (both ids kept, reported as one group, a true crossing); apart: measured difference of
    the velocities, m/s.
    """
    scenes = {d: script(job.kind, d) for d in (*DIFFERENCES, *job.differences)}
    motions = {d: walk(scene, job.seed) for d, scene in scenes.items()}
    camera = one_camera([motions[d] for d in DIFFERENCES])
    found: Outcomes = {v.name: [] for v in job.variants}
    streams = ("left",) if job.mode == "image" else ()
    for d in job.differences:
        live = observe(scenes[d].model_copy(update={"camera": camera}), motions[d], streams=streams)
        sequence, truth = in_memory(live) if streams else live, live.truth
        assert truth is not None
        two = encounter_of(truth, 1, 2)
        scene_is = {"apart": _apart(truth, two), "crossed": float(any(e.kind == "cross" for e in truth.events or ()))}
        with trained_once():
            answers = tracked(sequence, job.variants, job.mode)
        for v in job.variants:
            outcome = GroupMatches(truth, answers[v.name]).outcome(two, truth.fps)
            found[v.name].append({"kept": float(outcome.kept), "merged": float(outcome.merged), **scene_is})
    return found


def _apart(truth: Truth, two: Encounter) -> float:
    """Returns the mean difference of the groups' velocities, m/s, while they are near, or in all frames if never."""
    assert truth.groups is not None
    near = [f for f in two.frames if two.first <= f <= two.last] or list(two.frames)
    vel = [[truth.groups[f - 1].vel[truth.groups[f - 1].id == g][0] for f in near] for g in (two.a, two.b)]
    return float(np.hypot(*(np.array(vel[0]) - np.array(vel[1])).T).mean())


def difference(given: argparse.Namespace) -> Any:
    """Prints the tables, writes the chart and returns the outcomes by kind and input."""
    chosen = tuple(float(d) for d in given.only.split(",")) if given.only else DIFFERENCES
    ours = given.tracker
    variants = (
        Variant("defaults", ours),
        Variant("preset paper", ours, GroupPdaConfig.preset("paper").as_dict()),
        Variant("corrections=false", ours, {"corrections": False}),
        Variant('association="none"', ours, {"association": "none"}),
    )
    inputs: dict[str, tuple[DetectionMode, range]] = {
        "points": ("file", given.seeds),
        "pixels": ("image", given.image_seeds),
    }
    kind = tracker_registry.find(ours)
    threshold = float(kind.config_class().merge_velocity)  # type: ignore[attr-defined]
    panels, everything = [], {}
    for name in SECONDS:
        for what, (mode, seeds) in inputs.items():
            jobs = [DifferenceJob(name, seed, mode, chosen, variants) for seed in seeds]
            if not jobs:
                continue
            found = collected(jobs, given.workers)
            print_table(f"{name} from {what}, seeds {seeds_text(seeds)}", chosen, found)
            panels.append(_panel(f"{name}, {what}, {len(jobs)} seeds", chosen, found, threshold))
            everything[f"{name}, {what}"] = found
    print(f"\nmerge_velocity, marked in the chart: {threshold:g} m/s\n{lines(panels, given.out or OUT)}")
    return everything


def collected(jobs: Sequence[DifferenceJob], processes: int) -> Outcomes:
    """Returns the outcomes of all seeds by variant; within a seed in the order of differences."""
    made = {}
    with process_pool(processes) as run:
        for job, answer in run(outcomes_of_job, list(jobs)):
            made[job.seed] = answer
            print(f"\r{job.kind}: {len(made)}/{len(jobs)} seeds", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return {v.name: [r for seed in sorted(made) for r in made[seed][v.name]] for v in jobs[0].variants}


def _cells(rows: Sequence[dict[str, float]], steps: int, key: str) -> list[list[float]]:
    return [[r[key] for r in rows[k::steps]] for k in range(steps)]


def print_table(title: str, steps: Sequence[float], found: Outcomes) -> None:
    """Prints the table of one kind and input, one column per difference."""
    first = next(iter(found.values()))
    rows = {}
    for name, outcomes in found.items():
        kept, merged, crossed = (_cells(outcomes, len(steps), key) for key in ("kept", "merged", "crossed"))
        rows[f"kept, {name}"] = [share(int(sum(c)), len(c)) for c in kept]
        if any(map(any, crossed)):
            of_crossings = [[k for k, c in zip(*both, strict=True) if c] for both in zip(kept, crossed, strict=True)]
            rows[f"kept, {name}, of true crossings"] = [share(int(sum(c)), len(c)) for c in of_crossings]
        rows[f"merged, {name}"] = [share(int(sum(c)), len(c)) for c in merged]
    rows["true crossings"] = [f"{np.mean(c):.2f}" for c in _cells(first, len(steps), "crossed")]
    rows["difference while near, m/s"] = [f"{np.mean(c):.2f}" for c in _cells(first, len(steps), "apart")]
    table(title, "", [f"{s:g} m/s" for s in steps], rows)


def _panel(title: str, steps: Sequence[float], found: Outcomes, threshold: float) -> Panel:
    curves = {}
    for name, outcomes in found.items():
        ends = np.array([wilson(int(sum(c)), len(c)) for c in _cells(outcomes, len(steps), "kept")]).T
        curves[name] = tuple(ends)
    mark = {"merge_velocity": threshold}
    return Panel(title, steps, curves, "difference of velocities, m/s", "both ids kept", (0.0, 1.0), vertical=mark)
