"""Episodes of the baseline rule of groups: people who are known, as labels tell them, grouped by it and scored.

A rule tuned on simulated people's exact places on the ground asks for distances and velocities that no label has. So
they get a labeller's errors, and with odd seeds, as in most labelled videos, they are boxes in the camera's image,
whose distances shrink with depth, at one scale for the whole image, which may be wrong where they are, and without
velocities.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sim.rng import rng
from sim.types import Array, FrameTruth, Plane, Tracks, Truth
from tracking.environment.episodes import Cache, Episode, Source
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.link_rule import LinkRule


@dataclass(frozen=True)
class Labels:
    """sd, m, of a place, each way; time, s, for which its error lasts; filmed: boxes in the image, no velocities;
    scale: px per m are known up to this factor, either way."""

    sd: float
    time: float
    filmed: bool
    scale: float = 1.0


SURVEYED, FILMED = Labels(0.02, 0.1, filmed=False), Labels(0.06, 0.1, filmed=True, scale=1.5)
"""As people's places in BIWI's seq_hotel, and boxes in CAVIAR's Meet_WalkTogether1, leave a smooth way: by 0.02 m and
0.055 m, the latter jumping by 0.05 m from frame to frame at 25 fps. A scale is the median person's: those in front are
larger, those far behind smaller; 1.5 is a guess, fitted to nothing."""


def play_rule(source: Source, rule: LinkRule, cache: Cache) -> Episode:
    """The rule on the people of a source: who is who is known, so that the rule alone is judged; of a simulated one
    places as labels tell them."""
    from tracking.scoring.evaluation import evaluate

    truth = cache.hold(source).truth
    begun = time.perf_counter()
    known, px_per_m = truth, truth.px_per_m
    if source.entry is not None:
        labels, repeat = (SURVEYED, FILMED)[source.seed % 2], source.entry.repeat
        known = as_labelled(truth, labels, source.seed, repeat)
        px_per_m *= labels.scale ** rng(source.seed, "label", repeat=repeat).uniform(-1, 1)
    answers = derive(people_as_tracks(known), truth.fps, px_per_m, rule)
    grouped = time.perf_counter()
    found = evaluate(truth, answers)
    scored = time.perf_counter()
    scores = {key: value for key, value in found.items() if value == value}
    return Episode(
        source.name, source.seed, found["objective"], scores, truth.length, grouped - begun, scored - grouped
    )


def as_labelled(truth: Truth, labels: Labels, seed: int, repeat: int = 0) -> Truth:
    """The truth as such labels have it, errors of places a first-order process, each person's drawn alone."""
    assert truth.pos is not None, "simulated people have places"
    assert truth.box is not None, "scenes have cameras"
    stay, error = float(np.exp(-1 / (truth.fps * labels.time))), np.empty_like(truth.pos)
    for id in np.unique(truth.id).tolist():
        own = np.flatnonzero(truth.id == id)
        new = np.sqrt(1 - stay**2) * rng(seed, "label", id, repeat=repeat).standard_normal((len(own), 2))
        new[0] /= np.sqrt(1 - stay**2)
        error[own] = labels.sd * lfilter([1.0], [1.0, -stay], new, axis=0)
    if not labels.filmed:
        return truth.replace(pos=truth.pos + error)
    moved = np.concatenate([truth.px_per_m * error, np.zeros_like(error)], axis=1)
    return truth.replace(pos=None, vel=None, box=truth.box + moved)


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
