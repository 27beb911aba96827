"""Simulated scenes with true groups, as a fit of the belief sees them: rows of pairs, from positions that err.

Each scene is seen three times: with the errors of labels at 2.5 frames/s, with errors of any size, direction and
correlation over time, and as a camera at any height and tilt measures the feet of boxes. Errors are raw or smoothed,
as detections and trackers have them, at the scene's own rate or at 2.5 frames/s, with misses. Some scenes begin late,
as if the recording had begun there.
"""

from __future__ import annotations

import math
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from scenarios.loading.resolve import Entry, resolve
from scenarios.schema.scenario import CameraSpec
from sim.crowd.world import run
from sim.rng import rng
from sim.scene.standing import standing_points
from sim.sequence import observe, simulate
from sim.types import Array, Bools, Camera, Ints, Motion, Truth
from tracking.episodes.grouping_episodes import SURVEYED, unit_errors, with_label_errors
from tracking.grouping.pair_evidence import evidence
from tracking.grouping.person_motion import frames_per_step, step_rows

SLOW = 2.5  # Frames/s of the slow copies.
BEGINS = (0.0, 4.0, 8.0)  # s: times at which scenes of successive seeds begin, if at least LEAST s are left.
LEAST = 10.0
MOST_PAIRS = 250  # Pairs of a scene that are kept, drawn at random: bounds memory.
# Errors of positions, m: standard deviation across, factor along, greatest along.
ACROSS, ALONG, GREATEST = (0.03, 0.3), (1.0, 6.0), 1.3
HEIGHTS = (2.5, 20.0)  # m: of cameras.
FOOT, SIDE = (0.03, 0.14), (0.02, 0.08)  # Errors of boxes, in box heights (docs/reference/detector-profiles.md).
TIMES = (0.0, 0.3, 1.0, 1.0, 3.0)  # s: correlation times, of which one is drawn.
MISSED = (0.0, 0.05, 0.3)  # Shares of misses, of which one is drawn.
SMOOTHED = (0.0, 0.0, 0.3, 0.8)  # s: times over which a tracker smooths, 0: not at all; of which one is drawn.
LEAST_VISIBLE = 0.3


@dataclass(frozen=True)
class PairScene:
    """One scene as R rows of pairs, sorted by pair, then step (`pair_evidence`)."""

    pair: Ints
    values: np.ndarray  # (R, len(NAMES)), float32
    noise: Array  # (R,): of positions, m
    together: Bools  # (R,): True if the two are in one true group in the step's last frame
    step: Ints  # (R,)
    weight: int = 1  # number of times that the scene is named


def pair_scenes(names: Sequence[str], seeds: Sequence[int]) -> Iterator[PairScene]:
    """Yields up to three `PairScene`s for each entry of the named scenarios, suites or *.toml files and each seed; a
    scene without pairs is left out. A name that is given n times has the weight n."""
    for entry, weight in [(entry, count) for name, count in Counter(names).items() for entry in resolve(name)]:
        for seed in seeds:
            for found in scenes_of(entry, seed):
                yield replace(found, weight=weight)


def simulated(entry: Entry, seed: int) -> Truth:
    """Returns the truth of an entry that is simulated with a seed, without pictures and detections."""
    truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
    assert truth is not None
    return truth


def scenes_of(entry: Entry, seed: int) -> list[PairScene]:
    """Returns the copies of one scene that have pairs: as labels, with errors, and from a camera."""
    motion, repeat = run(entry.scenario, seed, entry.repeat), entry.repeat
    truth = observe(entry.scenario, motion).truth
    r = rng(seed, "label", 0, zlib.crc32(entry.name.encode()), repeat=repeat)
    begin = BEGINS[seed % len(BEGINS)] if truth.length / truth.fps >= LEAST + max(BEGINS) else 0.0
    slow, everybody = max(1, round(truth.fps / SLOW)), np.ones(len(truth.frame), bool)
    labelled = with_label_errors(truth, SURVEYED, seed, repeat).pos
    assert labelled is not None
    copies = [pair_scene(truth, labelled, everybody, slow, begin)]
    every, kept, errors = _drawn(truth, slow, r, seed, repeat)
    copies.append(pair_scene(truth, _erring(truth, errors, r), kept, every, begin))
    seen = _from_camera(entry, motion, r)
    if seen is not None:
        truth, camera = seen
        every, kept, errors = _drawn(truth, slow, r, seed + 1, repeat)
        assert truth.box is not None
        size = [math.exp(r.uniform(math.log(low), math.log(high))) for low, high in (SIDE, FOOT)]
        moved = truth.box + np.column_stack([errors * size * truth.box[:, 3:], np.zeros_like(errors)])
        pos = standing_points(moved, camera, motion.scene)
        kept &= np.isfinite(pos[:, 0]) & (truth.visibility > LEAST_VISIBLE)
        copies.append(pair_scene(truth, pos, kept, every, begin))
    return [copy for copy in copies if copy is not None]


def _drawn(truth: Truth, slow: int, r: np.random.Generator, seed: int, repeat: int) -> tuple[int, Bools, Array]:
    """Returns drawn conditions: of how many frames one is seen; who is, (R,); errors (R, 2) of about unit variance."""
    time, missed, smoothed = (float(r.choice(values)) for values in (TIMES, MISSED, SMOOTHED))
    errors = unit_errors(truth, time, seed, repeat)
    if smoothed:
        stay = math.exp(-1 / (truth.fps * smoothed))
        gain, drift = 1 - stay**2, (1 - stay) ** 2  # of a critically damped alpha-beta filter
        for id in np.unique(truth.id).tolist():
            own = truth.id == id
            errors[own] = lfilter([gain, drift - gain], [1, gain + drift - 2, 1 - gain], errors[own], axis=0)
    return int(r.choice([1, slow])), r.random(len(truth.id)) >= missed, errors


def _erring(truth: Truth, errors: Array, r: np.random.Generator) -> Array:
    """Returns positions (R, 2), m, with errors that are larger along one direction of the ground."""
    assert truth.pos is not None
    across, turn = math.exp(r.uniform(*np.log(ACROSS))), r.uniform(0, math.pi)
    along = min(across * r.uniform(*ALONG), GREATEST)
    x, y = errors[:, 0] * across, errors[:, 1] * along
    c, s = math.cos(turn), math.sin(turn)
    return truth.pos + np.column_stack([c * x - s * y, s * x + c * y])


def _from_camera(entry: Entry, motion: Motion, r: np.random.Generator) -> tuple[Truth, Camera] | None:
    """Returns the truth of a camera that is drawn, which looks at the middle of the scene; None if it sees nobody."""
    height, yaw = math.exp(r.uniform(*np.log(HEIGHTS))), r.uniform(0, 360)
    size = np.array(motion.scene.size)
    far = max(size) / 2 + r.uniform(0, 8)
    ahead = np.array([-math.sin(math.radians(yaw)), math.cos(math.radians(yaw))])
    x, y = size / 2 - far * ahead
    tilt = math.degrees(math.atan2(height, far))
    view = CameraSpec(
        image=(960, 720), focal_px=700.0, fps=entry.scenario.camera.fps, tilt_deg=tilt, yaw_deg=yaw, height=height,
        position=(x, y), crop=True,
    )  # fmt: skip
    seen = observe(entry.scenario.model_copy(update={"camera": view}), motion)
    if not len(seen.truth.frame):
        return None
    assert seen.camera is not None
    return seen.truth, seen.camera


def pair_scene(truth: Truth, pos: Array, kept: Bools, every: int, begin: float) -> PairScene | None:
    """Returns the rows of pairs of people from `begin` s on, each with whether the two are together; None without
    pairs. pos (R, 2), m: where people are measured; kept (R,): whether they are; every: of how many frames one is
    seen."""
    since, fps = round(begin * truth.fps), truth.fps / every
    ids, column = np.unique(truth.id, return_inverse=True)
    frame = truth.frame - 1 - since
    there = (frame >= 0) & (frame % every == 0)
    if truth.truncation is not None:
        there &= truth.truncation <= 0.5
    # true group by frame and column, -1 alone or absent
    labels = np.full(((truth.length - since - 1) // every + 1, len(ids)), -1, np.int64)
    labels[frame[there] // every, column[there]] = truth.group[there]
    there &= kept
    size = frames_per_step(fps)
    seen = step_rows(frame[there] // every, column[there], pos[there], len(labels), fps)
    parts = [(r.pair, r.step, r.a, r.b, r.noise, r.values.astype(np.float32)) for r in evidence(seen, size / fps)]
    if not parts:
        return None
    pair, step, a, b, noise, values = (np.concatenate(x) for x in zip(*parts, strict=True))
    first, second = (labels[step * size, p] for p in (a, b))
    drawn = np.flatnonzero(rng(len(pair), "label", 1).permutation(int(pair.max()) + 1)[pair] < MOST_PAIRS)
    order = drawn[np.lexsort((step[drawn], pair[drawn]))]
    together = (first >= 0) & (first == second)
    return PairScene(pair[order], values[order], noise[order], together[order], step[order])
