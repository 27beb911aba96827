"""Mode `difference` of benchmarks/group_pda.py: ids kept against how much two groups' velocities differ.

pass-by: two groups walk one way on lanes 2.2 m apart, at 1.2 m/s plus and minus half the difference, and are abreast in
the middle of the recording. crossing: two groups walk at 1.2 m/s on ways that cross in the middle of the recording at
the angle theta, 2 · 1.2 sin(theta / 2) being the difference; at 0 they walk on lanes as above. Groups have 2 and 2 or 3
people, who see and avoid each other; nobody else is there. One seed has one camera, which sees everybody at every
difference, so that nothing but the difference differs.
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

from benchmarks.chart import Panel, lines
from benchmarks.group_pda_ids import Encounter, Match, meeting
from benchmarks.group_pda_runs import Variant, held, seeds_of, tracked, trained_once
from benchmarks.group_pda_tables import share, table
from scenarios.schema.scenario import CameraSpec, Scenario
from sim.crowd.world import run as walk
from sim.scene.camera_placement import place_camera
from sim.sequence import observe
from sim.types import DetectionMode, Motion, Truth
from sim.workers.pool import process_pool
from tracking import tracker_registry
from tracking.stats import wilson

DIFFERENCES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.6, 2.0)  # m/s
PACE = 1.2  # m/s
LANES = 2.2  # m between the lanes of groups that do not cross
SECONDS = {"pass-by": 12.0, "crossing": 20.0}
MIDDLE = (22.0, 22.0)  # m
LOOSE = 0.3  # m: how far a start may be from its place, each way
OUT = Path("docs/group-pda-difference.svg")

Answer = dict[str, list[dict[str, float]]]


@dataclass(frozen=True)
class Job:
    """One seed of one kind at all differences."""

    kind: str
    seed: int
    mode: DetectionMode
    differences: tuple[float, ...]
    variants: tuple[Variant, ...]


def script(kind: str, difference: float) -> Scenario:
    """The scenario of a difference; its camera is solved for this very motion."""
    half = SECONDS[kind] / 2
    turn = asin(difference / 2 / PACE) if kind == "crossing" else 0.0
    side = LANES / 2 if turn == 0 else 0.0
    group = []
    for name, sign, size in (("a", 1.0, 2), ("b", -1.0, {"choice": [2, 3]})):
        speed = PACE + sign * difference / 2 if kind == "pass-by" else PACE
        way = np.array([cos(turn), sign * sin(turn)])
        x, y = np.array(MIDDLE) - [0.0, sign * side] - speed * half * way
        goal = np.array([x, y]) + 40.0 * way
        start = [{"uniform": [v - LOOSE, v + LOOSE]} for v in (x, y)]
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
    """The camera that has everybody of every motion in view."""
    parts = ("pos", "vel", "heading", "present", "intent")
    beside = {name: np.concatenate([getattr(m, name) for m in motions], axis=1) for name in parts}
    bodies = {name: np.concatenate([getattr(m, name) for m in motions]) for name in ("height", "width", "depth")}
    camera = place_camera(CameraSpec(), motions[0].replace(**beside, **bodies))
    x, y, z = camera.position.tolist()
    return CameraSpec(position=(x, y), height=z)


def one(job: Job) -> Answer:
    """By variant: for each difference whether both ids were kept, the two merged, they crossed, and the velocities'
    own difference, m/s."""
    scenes = {d: script(job.kind, d) for d in (*DIFFERENCES, *job.differences)}
    motions = {d: walk(scene, job.seed) for d, scene in scenes.items()}
    camera = one_camera([motions[d] for d in DIFFERENCES])
    found: Answer = {v.name: [] for v in job.variants}
    streams = ("left",) if job.mode == "image" else ()
    for d in job.differences:
        live = observe(scenes[d].model_copy(update={"camera": camera}), motions[d], streams=streams)
        sequence, truth = held(live) if streams else live, live.truth
        assert truth is not None
        two = meeting(truth, 1, 2)
        scene_is = {"apart": _apart(truth, two), "crossed": float(any(e.kind == "cross" for e in truth.events or ()))}
        with trained_once():
            said = tracked(sequence, job.variants, job.mode)
        for v in job.variants:
            fate = Match(truth, said[v.name]).fate(two, truth.fps)
            found[v.name].append({"kept": float(fate.kept), "merged": float(fate.merged), **scene_is})
    return found


def _apart(truth: Truth, two: Encounter) -> float:
    """Mean difference of the groups' velocities while they are near, m/s; over all frames where they never are."""
    assert truth.groups is not None
    near = [f for f in two.frames if two.first <= f <= two.last] or list(two.frames)
    vel = [[truth.groups[f - 1].vel[truth.groups[f - 1].id == g][0] for f in near] for g in (two.a, two.b)]
    return float(np.hypot(*(np.array(vel[0]) - np.array(vel[1])).T).mean())


def difference(given: argparse.Namespace) -> Any:
    """Must-show 1, its plot: tables, and a chart with a panel for each kind and input."""
    chosen = tuple(float(d) for d in given.only.split(",")) if given.only else DIFFERENCES
    ours = given.tracker
    variants = (
        Variant("defaults", ours),
        Variant("freeze=false", ours, {"freeze": False}),
        Variant('association="none"', ours, {"association": "none"}),
    )
    inputs: dict[str, tuple[DetectionMode, str]] = {
        "points": ("file", given.seeds),
        "pixels": ("image", given.image_seeds),
    }
    kind = tracker_registry.find(ours)
    threshold = float(kind.config_class().merge_velocity)  # type: ignore[attr-defined]
    panels, everything = [], {}
    for name in SECONDS:
        for seen, (mode, seeds) in inputs.items():
            jobs = [Job(name, seed, mode, chosen, variants) for seed in seeds_of(seeds)]
            if not jobs:
                continue
            found = collected(jobs, given.workers)
            tell(f"{name} from {seen}, seeds {seeds}", chosen, found)
            panels.append(_panel(f"{name}, {seen}, {len(jobs)} seeds", chosen, found, threshold))
            everything[f"{name}, {seen}"] = found
    print(f"\nmerge_velocity, marked in the chart: {threshold:g} m/s\n{lines(panels, given.out or OUT)}")
    return everything


def collected(jobs: Sequence[Job], processes: int) -> Answer:
    """By variant, the answers of all seeds, difference after difference within a seed."""
    made = {}
    with process_pool(processes) as run:
        for job, answer in run(one, list(jobs)):
            made[job.seed] = answer
            print(f"\r{job.kind}: {len(made)}/{len(jobs)} seeds", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return {v.name: [r for seed in sorted(made) for r in made[seed][v.name]] for v in jobs[0].variants}


def _cells(rows: Sequence[dict[str, float]], steps: int, key: str) -> list[list[float]]:
    return [[r[key] for r in rows[k::steps]] for k in range(steps)]


def tell(title: str, steps: Sequence[float], found: Answer) -> None:
    """Shares by difference: kept (of true crossings, too: people may give way and not cross at all), merged by the
    tracker; and what the scenes were."""
    some = next(iter(found.values()))
    rows = {}
    for name, answers in found.items():
        kept, merged, crossed = (_cells(answers, len(steps), key) for key in ("kept", "merged", "crossed"))
        rows[f"kept, {name}"] = [share(int(sum(c)), len(c)) for c in kept]
        if any(map(any, crossed)):
            of_crossings = [[k for k, c in zip(*both, strict=True) if c] for both in zip(kept, crossed, strict=True)]
            rows[f"kept, {name}, of true crossings"] = [share(int(sum(c)), len(c)) for c in of_crossings]
        rows[f"merged, {name}"] = [share(int(sum(c)), len(c)) for c in merged]
    rows["true crossings"] = [f"{np.mean(c):.2f}" for c in _cells(some, len(steps), "crossed")]
    rows["difference while near, m/s"] = [f"{np.mean(c):.2f}" for c in _cells(some, len(steps), "apart")]
    table(title, "", [f"{s:g} m/s" for s in steps], rows)


def _panel(title: str, steps: Sequence[float], found: Answer, threshold: float) -> Panel:
    curves = {}
    for name, answers in found.items():
        ends = np.array([wilson(int(sum(c)), len(c)) for c in _cells(answers, len(steps), "kept")]).T
        curves[name] = tuple(ends)
    mark = {"merge_velocity": threshold}
    return Panel(title, steps, curves, "difference of velocities, m/s", "both ids kept", (0.0, 1.0), vertical=mark)
