"""Episodes of the baseline rule of groups: true people as somebody's tracks, grouped by it, scored as all are."""

from __future__ import annotations

import time

import numpy as np

from sim.types import Array, FrameTruth, Plane, Tracks, Truth
from tracking.episodes import Cache, Episode, Source
from tracking.grouping import derive
from tracking.links import Grouping


def play_rule(source: Source, rule: Grouping, cache: Cache) -> Episode:
    """The rule on the people of a source: who is who is known, so that the rule alone is judged."""
    from tracking.scoring.evaluation import evaluate

    truth = cache.hold(source).truth
    begun = time.perf_counter()
    answers = derive(people_as_tracks(truth), truth.fps, truth.px_per_m, rule)
    grouped = time.perf_counter()
    found = evaluate(truth, answers)
    scored = time.perf_counter()
    scores = {key: value for key, value in found.items() if value == value}
    return Episode(
        source.name, source.seed, found["objective"], scores, truth.length, grouped - begun, scored - grouped
    )


def people_as_tracks(truth: Truth) -> list[Tracks]:
    """The true people of every frame as tracks without groups; velocities where the truth has them."""
    plane: Plane = "image" if truth.pos is None else "ground"
    return [_tracks(truth.at(index), plane) for index in range(1, truth.length + 1)]


def _tracks(here: FrameTruth, plane: Plane) -> Tracks:
    count = len(here.id)
    pos, vel = _places(here), here.vel if here.vel is not None else np.full((count, 2), np.nan)
    alone, cov = np.full(count, -1), np.zeros((count, 4, 4))
    return Tracks(here.index, here.t, plane, "person", here.id, alone, pos, vel, cov, here.box, np.ones(count))


def _places(here: FrameTruth) -> Array:
    if here.pos is not None:
        return here.pos
    assert here.box is not None, "labels have positions or boxes"
    return here.box[:, :2] + here.box[:, 2:] / 2
