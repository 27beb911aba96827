"""Random draws that true detections and false alarms share: uniforms of a frame, normals, Poisson counts, scores.

Everything is drawn as uniforms; all other numbers are quantiles at them. A changed setting therefore leaves all draws
as they were.

Normals that stay correlated over time are sums of parts: stationary AR(1) processes and white noise. A part has a
share w of the variance and a time constant tau in s. It is a process in time, not in frames: it runs on a clock of
CLOCK ticks per s, and a frame takes the nearest tick. At tick k it adds sqrt(w) x_k, where x_k = rho x_(k-1) +
sqrt(1 - rho²) e_k, e_k is a new standard normal, and rho = exp(-1 / (CLOCK tau)). The rest of the variance is white,
that is independent in each frame. Parts and rest together are N(0, 1); at a lag above 0, in s, their autocorrelation is
the sum of w exp(-lag / tau). Every process begins in frame 1, so that the draws of a frame do not depend on when a
person enters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sim.elementary import exp
from sim.rng import autoregression, normals, rng, uniforms
from sim.types import Array, Bools, Detections, Ints, Plane, Truth

if TYPE_CHECKING:
    from scenarios.schema.sensor import Memory, Sensor


# Scores without a profile: chosen after PETS09 and TUD-Campus, whose detector cuts its scores off at 0.5.
LOWEST_TRUE, HIDDEN_LOSS = 0.4, 0.2  # lowest score in full view; share of a score that is lost at visibility 0
FALSE_SCORES = (0.1, 0.95)  # evenly spaced quantiles


def frame_uniforms(generator: np.random.Generator, first: int, frames: int, per_frame: int) -> Array:
    """Returns uniforms, (frames, per_frame), for frames `first` to `first` + frames - 1 (frames from 1 on).

    They are above 0 and at most 1. The generator must be new. It first skips `per_frame` numbers for each frame before
    `first`, so that the numbers of a frame do not depend on `first`. Raises AttributeError if the generator's bit
    generator cannot be advanced; numpy's default can.
    """
    generator.bit_generator.advance((first - 1) * per_frame)  # type: ignore[attr-defined]
    return uniforms(generator, (frames, per_frame))


def interpolated_quantiles(curve: tuple[float, ...], u: Array) -> Array:
    """Returns the quantiles (N,) at u (N,), 0 to 1, of a distribution given by some of its quantiles.

    The result is linear between these. curve: evenly spaced quantiles from u = 0 to u = 1, at least two numbers, in
    ascending order. u outside 0 to 1 gives the first or last of them.
    """
    values = np.array(curve)
    place = np.clip(u, 0.0, 1.0) * (len(values) - 1)
    k = np.minimum(place.astype(np.int64), len(values) - 2)
    return np.asarray(values[k] + (place - k) * (values[k + 1] - values[k]))


def true_scores(u: Array, visibility: Array, sensor: Sensor) -> Array:
    """Returns the scores (N,) in [0, 1] of N true detections at uniforms u (N,) and visibility (N,), both 0 to 1.

    If `sensor.true_scores` is given, they are its quantiles at u, whatever the visibility. Else they are 1 for a
    detector without misses and false alarms (`sensor.detect_prob` 1, `sensor.clutter_rate` 0). Otherwise the score is
    (1 - 0.6 (1 - u)^16)(0.8 + 0.2 visibility): in full view its mean is 0.96, and 93 % are above 0.8.
    """
    if sensor.true_scores is not None:
        return interpolated_quantiles(sensor.true_scores, u)
    if sensor.detect_prob == 1.0 and sensor.clutter_rate == 0.0:
        return np.ones(len(u))
    tail = 1.0 - u
    for _ in range(4):  # not by a power function, whose last bit depends on the processor
        tail = tail * tail
    return np.asarray((1.0 - (1.0 - LOWEST_TRUE) * tail) * (1.0 - HIDDEN_LOSS * (1.0 - visibility)))


def false_scores(u: Array, sensor: Sensor) -> Array:
    """Returns the scores (N,) in [0, 1] of N false alarms at uniforms u (N,), 0 to 1.

    They are the quantiles of `sensor.false_scores` at u if given, else evenly spread from 0.1 to 0.95.
    """
    return interpolated_quantiles(sensor.false_scores or FALSE_SCORES, u)


@dataclass(frozen=True)
class Readings:
    """R detections of a whole sequence, true ones or false alarms; rows need not be sorted by frame.

    frame (R,)    frame number, from 1 on
    pos (R, 2)    x, y in m on the ground; the box's centre in px where the truth has no positions
    box (R, 4)    left, top, width, height in px; None without boxes
    score (R,)    in [0, 1]
    order (R,)    random, above 0 and at most 1: the detections of a frame are listed in ascending order of it, so that
                  a place in the list tells nothing
    id (R,)       of the detected person; None: all are false alarms
    """

    frame: Ints
    pos: Array
    box: Array | None
    score: Array
    order: Array
    id: Ints | None = None


def in_frames(readings: Readings, looked: Bools) -> Readings:
    """Returns the readings of those frames in which the detector looked: looked (F,), of the frames 1 to F."""
    if looked.all():
        return readings
    frame = readings.frame
    kept = (frame >= 1) & (frame <= len(looked)) & looked[np.clip(frame, 1, len(looked)) - 1]
    box = None if readings.box is None else readings.box[kept]
    id = None if readings.id is None else readings.id[kept]
    return Readings(frame[kept], readings.pos[kept], box, readings.score[kept], readings.order[kept], id)


def detections_by_frame(true: Readings, false: Readings, truth: Truth) -> tuple[list[Detections], list[Ints]]:
    """Returns one Detections for each of the frames 1 to truth.length, true detections and false alarms together, and
    for each the ids (M,) of the detected people, -1 for a false alarm.

    Those of a frame are sorted by `order`, which is random. A frame without any has empty Detections. The plane is
    "ground" (positions in m) if the truth has positions, else "image" (px). Boxes are None unless `true` and `false`
    both have boxes. Velocities are None. Readings outside frames 1 to truth.length are dropped.
    """
    frame = np.concatenate([true.frame, false.frame])
    order = np.lexsort((np.concatenate([true.order, false.order]), frame))
    pos = np.concatenate([true.pos, false.pos])[order]
    score = np.concatenate([true.score, false.score])[order]
    ids = [np.full(len(r.frame), -1) if r.id is None else r.id for r in (true, false)]
    box = None if true.box is None or false.box is None else np.concatenate([true.box, false.box])[order]
    plane: Plane = "image" if truth.pos is None else "ground"
    cuts = np.searchsorted(frame[order], np.arange(1, truth.length + 2))
    found = []
    for k, (a, b) in enumerate(pairwise(cuts)):
        here = None if box is None else box[a:b]
        found.append(Detections(k + 1, k / truth.fps, plane, pos[a:b], None, here, score[a:b]))
    owners = np.concatenate(ids)[order]
    return found, [owners[a:b] for a, b in pairwise(cuts)]


CLOCK = 50.0  # Hz, of what lasts in the simulated detector: errors, misses, false alarms


def correlated_normals(
    fresh: Array, memory: Sequence[Memory], first: int, fps: float, seed: int, *keys: int, repeat: int = 0
) -> Array:
    """Returns standard normals (F, D), correlated over time, of frames `first` to `first` + F - 1 (frames from 1 on).

    fresh (F, D): standard normals, used as the white part, which has the variance that no part of the memory takes.
    memory: share of the variance and time constant (s) of each AR(1) part; the shares must not add up to more than 1,
    which is not checked. fps: frames per second. The D columns are independent. The random stream of a part is named by
    the seed, `keys`, the part's number from 0 on, and repeat (number of the suite entry's copy, 0 without copies). It
    begins in frame 1, whatever `first` is. If memory is empty, `fresh` itself is returned; otherwise it is not changed.

    Raises ValueError for a negative seed or key.
    """
    if not memory:
        return fresh
    white = max(0.0, 1.0 - sum(part.share for part in memory))
    out = np.sqrt(white) * fresh
    tick = ticks(np.arange(first, first + len(fresh)), fps)
    for k, part in enumerate(memory):
        e = normals(uniforms(rng(seed, "detect", *keys, k, repeat=repeat), (int(tick[-1]) + 1, fresh.shape[1])))
        out += np.sqrt(part.share) * autoregression(e, exp(-1.0 / (CLOCK * part.time)))[tick]
    return np.asarray(out)


def ticks(frame: Ints, fps: float) -> Ints:
    """Returns the ticks (F,), from 0, of the detector's clock (50 Hz) nearest to the times of frames (F,), from 1."""
    return np.asarray(np.floor((frame - 1) / fps * CLOCK + 0.5), np.int64)
