"""Episodes for tuning the baseline rule of groups: people of known identity, grouped by the rule and scored.

A rule tuned on exact simulated positions would need distances and velocities that no label has. The positions therefore
get a labeller's errors. With odd seeds people are boxes in the camera image without velocities, as in most labelled
videos; the scale of the image is then one number, which may be wrong.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from sim.rng import rng
from sim.types import Array, Truth
from tracking.episodes.episode import Episode, Source, SourceCache
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule


@dataclass(frozen=True)
class LabelErrors:
    """The random errors of labelled positions: their standard deviation, m, and correlation time, s; if filmed, they
    are errors of boxes in the image, whose scale is wrong by a random factor, too."""

    sd: float  # standard deviation of each coordinate, m; of boxes it is multiplied by the true image scale
    time: float  # correlation time, s
    filmed: bool  # boxes in the image without velocities; False: positions on the ground
    scale: float = 1.0  # the image scale is multiplied by a log-uniform factor from 1 / scale to scale


# Measured as deviations of labelled people from smooth paths: 0.02 m in BIWI's seq_hotel, 0.055 m in CAVIAR's
# Meet_WalkTogether1, where they jump by 0.05 m between frames at 25 fps. The scale 1.5 is a guess.
SURVEYED, FILMED = LabelErrors(0.02, 0.1, filmed=False), LabelErrors(0.06, 0.1, filmed=True, scale=1.5)


def play_rule(source: Source, rule: LinkRule, source_cache: SourceCache) -> Episode:
    """Returns the episode of the baseline rule of groups on the people of a source, whose ids are known. People of a
    simulated source get the errors of labels first, `SURVEYED` for even seeds, `FILMED` for odd ones."""
    from tracking.scoring.evaluation import evaluate

    truth = source_cache.open(source).truth
    start = time.perf_counter()
    people, px_per_m = truth, truth.px_per_m
    if source.entry is not None:
        errors, repeat = (SURVEYED, FILMED)[source.seed % 2], source.entry.repeat
        people = with_label_errors(truth, errors, source.seed, repeat)
        px_per_m *= errors.scale ** rng(source.seed, "label", repeat=repeat).uniform(-1, 1)
    tracks = derive(people_as_tracks(people), truth.fps, px_per_m, rule)
    seconds = time.perf_counter() - start
    found = evaluate(truth, tracks, similarity="image" if tracks and tracks[0].plane == "image" else None)
    scores = {key: value for key, value in found.items() if value == value}
    return Episode(source.name, source.seed, found["objective"], scores, truth.length, seconds)


def with_label_errors(truth: Truth, errors: LabelErrors, seed: int, repeat: int = 0) -> Truth:
    """Returns a copy of the truth with errors added to positions: a first-order autoregressive process per coordinate.
    If the errors are of filmed people, the copy has boxes, displaced in the image, and no positions."""
    assert truth.pos is not None, "simulated people have positions"
    assert truth.box is not None, "scenes have cameras"
    error = errors.sd * unit_errors(truth, errors.time, seed, repeat)
    if not errors.filmed:
        return truth.replace(pos=truth.pos + error)
    moved = np.concatenate([truth.px_per_m * error, np.zeros_like(error)], axis=1)
    return truth.replace(pos=None, vel=None, box=truth.box + moved)


def unit_errors(truth: Truth, time: float, seed: int, repeat: int = 0) -> Array:
    """Returns errors (R, 2) of unit variance for the rows of a truth: per person and coordinate a first-order
    autoregressive process with the correlation time `time`, s."""
    stay, error = float(np.exp(-1 / (truth.fps * time))) if time else 0.0, np.empty((len(truth.id), 2))
    for id in np.unique(truth.id).tolist():
        own = np.flatnonzero(truth.id == id)
        new = np.sqrt(1 - stay**2) * rng(seed, "label", id, repeat=repeat).standard_normal((len(own), 2))
        new[0] /= np.sqrt(1 - stay**2)  # so that the variance is 1 from the first row on
        error[own] = lfilter([1.0], [1.0, -stay], new, axis=0)
    return error
