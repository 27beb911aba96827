"""Sequences that are made once and tracked by several trackers, for the modes of `benchmarks.group_pda`.

A row holds every score of the catalogue by key, and two counts: "pairs", encounters of two groups, and "kept",
encounters after which both groups have their ids (benchmarks/group_pda/encounters.py).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.group_pda.encounters import ids_kept
from benchmarks.support.in_memory import in_memory
from benchmarks.support.replaced_code import Replacement, replaced_code
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry
from sim.sequence import simulate
from sim.types import Array, Bools, DetectionMode, Image, Tracks, Truth
from sim.types import Sequence as Recording
from sim.workers.pool import process_pool
from tracking.detect import background
from tracking.detect.background_training import Trained, train
from tracking.papers.group_pda import merging_and_splitting
from tracking.papers.group_pda import tracker as group_pda
from tracking.papers.group_pda.association import PointClaims, associate
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.scaled_parameters import ScaledParameters
from tracking.running.run import TrackingRun, track
from tracking.scoring import evaluate
from tracking.scoring.ground_or_image import in_one_plane

Row = dict[str, float]


@dataclass(frozen=True)
class Variant:
    """A tracker and its parameters.

    grouping: of a tracker of people, "rule" or "belief". in_image: the answers of a tracker of people from pixels are
    scored in the image, as groups from pixels are: its groups stay, their hulls are those of its boxes.
    replaced: a name in REPLACED, a rule of `group-pda` without a parameter that is replaced.
    """

    name: str
    tracker: str
    params: Mapping[str, object] = field(default_factory=dict)
    grouping: str | None = None
    in_image: bool = False
    replaced: str = ""


@dataclass(frozen=True)
class TrackingJob:
    """One sequence to make, and the trackers that track it."""

    entry: Entry
    seed: int
    mode: DetectionMode
    variants: tuple[Variant, ...]


def trackers(name: str, mode: DetectionMode) -> tuple[Variant, ...]:
    """Returns the tracker, its preset "paper", and the baselines: rule and belief over `blob`."""
    ground = ", on the ground" if mode == "image" else ""
    blob = [
        Variant(f"blob + {grouping}{place}", "blob", grouping=grouping, in_image=in_image)
        for grouping in ("rule", "belief")
        for place, in_image in ([("", True), (ground, False)] if ground else [("", False)])
    ]
    return (Variant(name, name), Variant("preset paper", name, GroupPdaConfig.load("paper").as_dict()), *blob)


def with_points(entry: Entry, points: str | None) -> Entry:
    """Returns the entry with another `sensor.points` ("own", "seen", "foot"); None keeps the scenario's."""
    if points is None:
        return entry
    sensor = entry.scenario.sensor.model_copy(update={"points": points})
    return replace(entry, scenario=entry.scenario.model_copy(update={"sensor": sensor}))


def measure(jobs: Iterable[TrackingJob], processes: int) -> Iterator[tuple[TrackingJob, dict[str, Row]]]:
    """Yields each job with its rows by variant, as they are done.

    A seed that cannot be simulated is printed and left out.
    """
    todo = list(jobs)
    with process_pool(processes) as run:
        for done, (job, found) in enumerate(run(rows_of_job, todo), 1):
            print(f"\r{done}/{len(todo)} sequences", end="", file=sys.stderr, flush=True)
            if isinstance(found, str):
                print(f"\n{job.entry.name}, seed {job.seed}, left out: {found}", file=sys.stderr)
                continue
            yield job, found
    print(file=sys.stderr)


def rows_of_job(job: TrackingJob) -> dict[str, Row] | str:
    """Returns the rows of one sequence by variant; the error as text if it cannot be simulated."""
    streams = ("left",) if job.mode == "image" else ()
    try:
        live = simulate(job.entry.scenario, job.seed, job.entry.repeat, streams=streams)
        truth = live.truth
    except FlockscopeError as error:
        return error.line()
    assert truth is not None
    sequence = in_memory(live) if streams else live
    with trained_once():
        answers = tracked(sequence, job.variants, job.mode)
    image = {v.name: in_one_plane(truth, [answers[v.name]], [True], "image")[0][0] for v in job.variants if v.in_image}
    return {v.name: row(truth, image.get(v.name, answers[v.name])) for v in job.variants}


def tracked(sequence: Recording, variants: Iterable[Variant], mode: DetectionMode) -> dict[str, TrackingRun]:
    """Returns the answers of each variant; variants that differ only in how they are scored share one run."""
    made: dict[tuple[str, str, str | None, str], TrackingRun] = {}
    found = {}
    for v in variants:
        key = v.tracker, repr(v.params), v.grouping, v.replaced
        if key not in made:
            with replaced_code([REPLACED[v.replaced]] if v.replaced else []):
                made[key] = track(v.tracker, sequence, params=v.params or None, detections=mode, grouping=v.grouping)
        found[v.name] = made[key]
    return found


likeness, moment = merging_and_splitting.likeness, merging_and_splitting.moment


def unbroken(moments: list[merging_and_splitting.PairMoment], alike: float) -> Array:
    """Replaces `likeness`: a moment speaks for one group with all its time, or takes back all before."""
    return np.where(likeness(moments, alike) > 0, 1.0, -1e3)


def evenly(bank: GroupBank, points: Array, *others: object) -> Array:
    """Replaces `place_density`: nothing is known of members' places."""
    del others
    return np.ones((len(bank), len(points)))


def by_centroids(bank: GroupBank, *pair: Any) -> merging_and_splitting.PairMoment:
    """Replaces `moment`: groups walk as their centroids do."""
    return moment(replace(bank, anchor=np.zeros_like(bank.anchor)), *pair)


def without_hiding(
    bank: GroupBank, claims: PointClaims, region: Array, ratio: Array, scaled: ScaledParameters, t: float
) -> Bools:
    """Replaces `associate`: groups whose points are all more probably others' are measured by them."""
    shared = replace(scaled, config=replace(scaled.config, corrections=False))  # the kernels' rules stay
    return associate(bank, claims, region, ratio, shared, t)


def as_given(points: Array, *others: object) -> Array:
    """Replaces `below_heads`: the points of hidden feet stay where they are."""
    del others
    return points


REPLACED: Mapping[str, Replacement] = {
    "evidence over time: an unbroken time in its place": (merging_and_splitting, "likeness", unbroken),
    "members' places in shared points": (group_pda, "place_density", evenly),
    "walks of the members seen in two frames": (merging_and_splitting, "moment", by_centroids),
    "hidden groups": (group_pda, "associate", without_hiding),
    "hidden feet below heads": (group_pda, "below_heads", as_given),
}


@contextmanager
def trained_once() -> Iterator[None]:
    """Within it all trackers share the training on a background sample with the same options.

    Training takes as long as tracking 200 frames. Its result depends on nothing else and is never changed.
    """
    known: dict[tuple[int, float, bool], Trained] = {}

    def once(sample: Image, rate: float, follow_gain: bool) -> Trained:
        key = id(sample), rate, follow_gain
        if key not in known:
            known[key] = train(sample, rate, follow_gain)
        return known[key]

    with mock.patch.object(background, "train", once):
        yield


def row(truth: Truth, answers: Sequence[Tracks]) -> Row:
    """Returns the row of one tracker's answers."""
    kept = ids_kept(truth, answers)
    return {**evaluate(truth, answers), "pairs": len(kept), "kept": sum(kept)}
