"""Sequences, each made once and tracked by several trackers: what the modes of benchmarks/group_pda.py have in common.

A row holds every score of the catalogue by key, and "pairs", "kept", "merged": encounters of two groups and what became
of them (benchmarks/group_pda_ids.py).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from unittest import mock

import numpy as np

from benchmarks.group_pda_ids import fates
from scenarios.errors import FlockscopeError, InputError
from scenarios.loading.resolve import Entry
from sim.sequence import simulate
from sim.truth.group_hulls import box_groups
from sim.types import DetectionMode, Frame, Image, Tracks, Truth
from sim.types import Sequence as Recording
from sim.workers.pool import process_pool
from tracking.detect import background
from tracking.detect.background_training import Trained, train
from tracking.run import TrackingRun, track
from tracking.scoring import evaluate

Row = dict[str, float]


@dataclass(frozen=True)
class Variant:
    """A tracker and its parameters. in_image: a tracker of people from pixels is scored in the image, as groups from
    pixels are: its groups stay, their shapes are the hulls of its boxes."""

    name: str
    tracker: str
    params: Mapping[str, object] = field(default_factory=dict)
    in_image: bool = False


@dataclass(frozen=True)
class Job:
    """One sequence to make, and who is to track it."""

    entry: Entry
    seed: int
    mode: DetectionMode
    variants: tuple[Variant, ...]


def trackers(name: str, mode: DetectionMode) -> tuple[Variant, ...]:
    """The tracker, its paper's ablation, and the baseline: groups by the baseline rule over `blob`."""
    blob = (Variant("blob + baseline rule", "blob", in_image=True),) if mode == "image" else ()
    on_ground = "blob …, on the ground" if mode == "image" else "blob + baseline rule"
    ours = (Variant(name, name), Variant('association="none"', name, {"association": "none"}))
    return (*ours, *blob, Variant(on_ground, "blob"))


def measure(jobs: Iterable[Job], processes: int) -> Iterator[tuple[Job, dict[str, Row]]]:
    """Rows by variant of each job as they come; a seed that cannot be is said and left out."""
    todo = list(jobs)
    with process_pool(processes) as run:
        for done, (job, found) in enumerate(run(one, todo), 1):
            print(f"\r{done}/{len(todo)} sequences", end="", file=sys.stderr, flush=True)
            if isinstance(found, str):
                print(f"\n{job.entry.name}, seed {job.seed}, left out: {found}", file=sys.stderr)
                continue
            yield job, found
    print(file=sys.stderr)


def one(job: Job) -> dict[str, Row] | str:
    """One sequence by all variants; why it cannot be, where it cannot."""
    streams = ("left",) if job.mode == "image" else ()
    try:
        live = simulate(job.entry.scenario, job.seed, job.entry.repeat, streams=streams)
        truth = live.truth
    except FlockscopeError as error:
        return error.line()
    assert truth is not None
    sequence = held(live) if streams else live
    with trained_once():
        said = tracked(sequence, job.variants, job.mode)
    return {v.name: row(truth, seen(said[v.name]) if v.in_image else said[v.name]) for v in job.variants}


def tracked(sequence: Recording, variants: Iterable[Variant], mode: DetectionMode) -> dict[str, TrackingRun]:
    """The answers of each variant; those that differ in how they are scored are one run."""
    made: dict[tuple[str, str], TrackingRun] = {}
    found = {}
    for v in variants:
        key = v.tracker, repr(v.params)
        if key not in made:
            made[key] = track(v.tracker, sequence, params=v.params or None, detections=mode)
        found[v.name] = made[key]
    return found


@contextmanager
def trained_once() -> Iterator[None]:
    """Within it a sample of the background is trained on once for all who do so in the same way: training takes as long
    as tracking 200 frames, and its result depends on nothing else and is never changed."""
    known: dict[tuple[int, float, bool], Trained] = {}

    def once(sample: Image, rate: float, follow_gain: bool) -> Trained:
        key = id(sample), rate, follow_gain
        if key not in known:
            known[key] = train(sample, rate, follow_gain)
        return known[key]

    with mock.patch.object(background, "train", once):
        yield


def held(sequence: Recording) -> Recording:
    """The sequence with its pictures, the background's too, in memory."""
    frames, sample = tuple(sequence.frames()), sequence.background()
    assert sample is not None, "a sequence with pictures has a background"
    return replace(sequence, frames=partial(_again, frames), load_background=lambda: sample)


def _again(frames: Sequence[Frame]) -> Iterator[Frame]:
    return iter(frames)


def row(truth: Truth, answers: Sequence[Tracks]) -> Row:
    """All scores of one tracker's answers."""
    became = fates(truth, answers)
    own = {"pairs": len(became), "kept": sum(f.kept for f in became), "merged": sum(f.merged for f in became)}
    return {**evaluate(truth, answers), **own}


def seen(answers: Sequence[Tracks]) -> list[Tracks]:
    """Tracks of people on the ground, with boxes, as tracks in the image: places are the middles of the boxes."""
    return [_seen(t) for t in answers]


def _seen(t: Tracks) -> Tracks:
    box = np.zeros((0, 4)) if t.box is None else t.box
    middle, none = box[:, :2] + box[:, 2:] / 2, np.full((len(box), 2), np.nan)
    order = np.argsort(t.id)
    rows = (t.id[order], t.group[order], middle[order], none, box[order])
    groups = box_groups(np.full(len(box), t.index), *rows, t.index, 1)[0]
    events = tuple(replace(e, pos=_centre(middle, np.isin(t.id, e.members))) for e in t.events)
    return t.replace(plane="image", pos=middle, vel=none, groups=groups, events=events)


def _centre(middle: np.ndarray, who: np.ndarray) -> tuple[float, float]:
    x, y = middle[who].mean(axis=0) if who.any() else (float("nan"), float("nan"))
    return float(x), float(y)


def seeds_of(text: str) -> range:
    """a:b as a range."""
    try:
        first, last = map(int, text.split(":"))
    except ValueError:
        raise InputError(place="--seeds", got=text, expected="a:b", remedy="write for example 20000:20100") from None
    return range(first, last)
