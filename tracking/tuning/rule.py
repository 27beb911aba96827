"""Episodes of the baseline rule of groups: people who are known, as labels tell them, grouped by it and scored.

Simulated people are exact, labels are not: a rule tuned on exact places asks for velocities that no label has. So
places get a labeller's errors, and with odd seeds, as in most labelled videos, no velocities.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sim.types import Array, FrameTruth, Plane, Tracks, Truth
from tracking.episodes import Cache, Episode, Source
from tracking.grouping import derive
from tracking.links import Grouping


@dataclass(frozen=True)
class Labels:
    """sd, m, of a place, each way; time, s, for which its error lasts; told: are velocities known?"""

    sd: float
    time: float
    told: bool


SURVEYED, FILMED = Labels(0.02, 0.1, told=True), Labels(0.06, 0.1, told=False)
"""As people's places in BIWI's seq_hotel, and boxes in CAVIAR's Meet_WalkTogether1, leave a smooth way: by 0.02 m and
0.055 m, the latter jumping by 0.05 m from frame to frame at 25 fps."""


def play_rule(source: Source, rule: Grouping, cache: Cache) -> Episode:
    """The rule on the people of a source: who is who is known, so that the rule alone is judged; of a simulated one
    places as labels tell them."""
    from tracking.scoring.evaluation import evaluate

    truth = cache.hold(source).truth
    begun = time.perf_counter()
    known = as_labelled(truth, (SURVEYED, FILMED)[source.seed % 2], source.seed) if source.simulated else truth
    answers = derive(people_as_tracks(known), truth.fps, truth.px_per_m, rule)
    grouped = time.perf_counter()
    found = evaluate(truth, answers)
    scored = time.perf_counter()
    scores = {key: value for key, value in found.items() if value == value}
    return Episode(
        source.name, source.seed, found["objective"], scores, truth.length, grouped - begun, scored - grouped
    )


def as_labelled(truth: Truth, labels: Labels, seed: int) -> Truth:
    """The truth with people's places on the ground as such labels have them, errors a first-order process."""
    assert truth.pos is not None, "simulated people have places"
    r, stay = np.random.default_rng(seed), float(np.exp(-1 / (truth.fps * labels.time)))
    error = np.sqrt(1 - stay**2) * r.standard_normal(truth.pos.shape)
    for id in np.unique(truth.id).tolist():
        own = np.flatnonzero(truth.id == id)
        error[own[0]] /= np.sqrt(1 - stay**2)
        error[own] = lfilter([1.0], [1.0, -stay], error[own], axis=0)
    return truth.replace(pos=truth.pos + labels.sd * error, vel=truth.vel if labels.told else None)


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
