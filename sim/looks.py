"""Draws how the people of a motion look, what they carry, and the distractors of its scene (`[looks]` of a scenario).

The phase of a person's gait grows with the distance walked, by one turn for each stride of h (0.5 + 0.25 v) m, at
height h in m and speed v in m/s; the legs' swing grows with v. Distractors stand, or move along a straight line, where
of CANDIDATES places they come least near to people.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sim.elementary import dot, length, unit
from sim.rng import draw, look_seed, rng
from sim.scene.figure import DISTRACTORS, HELD, THINGS, WORN
from sim.types import Array, Looks, Motion, Scene

if TYPE_CHECKING:
    from scenarios.schema.looks import Distractors, LooksSpec

WINDOW = 0.25  # s before and after: over which the speed is measured
STANDS, BRISK, MOST_SWING = 0.2, 1.4, 1.1  # m/s, m/s: speeds of swing 0 and 1; swing at most
CANDIDATES = 24
PEOPLE, PLACES = 1, 4  # keys of the random role "looks"; sim.render.people has 2 and 3
WALKING = {"dog": (2 / 3, 1.2), "car": (1 / 2, 5.0)}  # share that moves, and how fast, m/s
SIZES = {"dog": (0.7, 1.15), "car": (0.95, 1.08), "bollard": (0.8, 1.2)}  # scale, from and to
MARGIN = 0.15  # distractors may be outside the world by this share of its size
DOG_STRIDE = 0.7  # m
HOLDER = 1.75  # m: height of the person for whom held things have scale 1


def with_looks(motion: Motion, spec: LooksSpec | None) -> Motion:
    """Returns the motion with looks and clothes; itself if spec is None."""
    if spec is None:
        return motion
    columns = range(motion.present.shape[1])
    seed = look_seed(motion.seed, motion.name)
    streams = [rng(seed, "looks", PEOPLE, k + 1, repeat=motion.repeat) for k in columns]
    start, u = np.empty(len(columns)), np.empty((len(columns), len(WORN) + len(HELD)))
    clothes = np.full((len(columns), 2, 3), np.nan) if motion.clothes is None else motion.clothes.copy()
    for k, source in enumerate(streams):
        start[k], u[k], free = source.random(), source.random(u.shape[1]), source.random(2)
        any_colour = source.uniform(15.0, 235.0, (2, 3))
        chosen = (free < spec.colours) & np.isnan(clothes[k]).all(axis=1)
        clothes[k, chosen] = any_colour[chosen]
    phase, swing = gait(motion, start)
    has = u < np.array([getattr(spec.carry, name) for name in (*WORN, *HELD)])
    wears = any(getattr(spec.carry, name) > 0 for name in WORN)
    owner, held = np.nonzero(has[:, len(WORN) :])
    others = _distractors(motion, spec.distractors)
    looks = Looks(
        limbs=spec.figure == "limbs", phase=phase, swing=swing, worn=has[:, : len(WORN) if wears else 0],
        kind=np.concatenate([held, [one.kind for one in others]]).astype(np.int64),
        number=np.concatenate([owner + 1, [one.number for one in others]]).astype(np.int64),
        size=np.concatenate([motion.height[owner] / HOLDER, [one.size for one in others]]),
        place=np.concatenate([motion.pos[:, owner], *(one.place[:, None] for one in others)], axis=1),
        turn=np.concatenate([motion.heading[:, owner], *(one.turn[:, None] for one in others)], axis=1),
        step=np.concatenate([phase[:, owner], *(one.step[:, None] for one in others)], axis=1),
    )  # fmt: skip
    return motion.replace(clothes=clothes, looks=looks)


def gait(motion: Motion, start: Array) -> tuple[Array, Array]:
    """Returns the phase (T, P), rad, and the swing (T, P) of the gait. start (P,): phase at first, in turns."""
    ahead = length(np.diff(motion.pos, axis=0))
    moved = np.isfinite(ahead)
    walked, steps = (_sums(each) for each in (np.where(moved, ahead, 0.0), moved.astype(float)))
    frame, reach = np.arange(len(walked)), max(round(WINDOW * motion.fps), 1)
    low, high = np.maximum(frame - reach, 0), np.minimum(frame + reach, len(frame) - 1)
    speed = (walked[high] - walked[low]) / np.maximum(steps[high] - steps[low], 1.0) * motion.fps
    stride = motion.height * (0.5 + 0.25 * speed)
    turns = start + _sums(np.diff(walked, axis=0) / stride[1:])
    return 2 * np.pi * (turns - np.floor(turns)), np.clip((speed - STANDS) / (BRISK - STANDS), 0.0, MOST_SWING)


def _sums(steps: Array) -> Array:
    return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


class _Distractor(NamedTuple):
    kind: int  # index in THINGS
    number: int  # among those of its kind, from 1
    size: float  # scale
    place: Array  # (T, 2) m
    turn: Array  # (T,) rad
    step: Array  # (T,) rad


def _distractors(motion: Motion, spec: Distractors) -> list[_Distractor]:
    found: list[_Distractor] = []
    seed = look_seed(motion.seed, motion.name)
    rate = max(round(motion.fps / 2), 1)  # places are compared twice a second
    t = np.arange(len(motion.present)) / motion.fps
    taken = np.concatenate([motion.pos[::rate], _solid_points(motion.scene, len(t[::rate]))], axis=1)
    for name in DISTRACTORS:
        source = rng(seed, "looks", PLACES, THINGS.index(name), repeat=motion.repeat)
        wanted = draw(getattr(spec, name), source)
        for number in range(1, int(wanted + source.random()) + 1):
            source = rng(seed, "looks", PLACES, THINGS.index(name), number, repeat=motion.repeat)
            moves, speed = WALKING.get(name, (0.0, 0.0))
            low, high = SIZES.get(name, (1.0, 1.0))
            size, speed = low + (high - low) * source.random(), speed * (source.random() < moves)
            turn, way = 2 * np.pi * source.random(CANDIDATES), speed * (t - t[-1] * source.random((CANDIDATES, 1)))
            point = motion.scene.size * ((1 + 2 * MARGIN) * source.random((CANDIDATES, 2)) - MARGIN)
            paths = point[:, None] + way[..., None] * unit(turn)[:, None]
            room = [np.nanmin(dot(away, away), initial=np.inf) for away in (p[::rate, None] - taken for p in paths)]
            best = int(np.argmax(room))
            place = paths[best]
            step = 2 * np.pi * way[best] / DOG_STRIDE
            found.append(_Distractor(THINGS.index(name), number, size, place, np.full(len(t), turn[best]), step))
            taken = np.concatenate([taken, place[::rate, None]], axis=1)
    return found


def _solid_points(scene: Scene, times: int) -> Array:
    """Returns points (times, Q, 2) m at most 0.5 m apart on the walls, and the middles of the pillars."""
    on_walls = [a + (b - a) * np.linspace(0, 1, 2 + int(2 * length(b - a)))[:, None] for a, b in scene.walls]
    points = np.concatenate([*on_walls, scene.pillars[:, :2]])
    return np.broadcast_to(points, (times, *points.shape))
