"""Shapes that are put together of ellipsoids: a person with limbs, what people carry, and distractors.

All parts of a shape stand in its own axes, across (to the right), along its heading and up, from the place on the
ground. A part is turned only by its pitch, about the axis across: at a positive pitch its lower end is ahead.

The gait: a leg has phase p, the other one p + pi. The thigh has the pitch STANCE cos p + swing (STEP cos p + LEAN), and
the knee is bent by swing (BENT + KNEE max(0, -sin p)²), most while the thigh moves forwards. The arm of a side moves
against its leg, its elbow bent by ELBOW. The hip sinks until the lower foot is on the ground. swing is 0 for a person
who stands and 1 at 1.4 m/s. Boxes are as wide as those of real people seen from afar: 0.27 to 0.44 of their height.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.elementary import cos, length, sin
from sim.types import Array, Bools, Ints

# Lengths, and heights of ankle and shoulder; shares of the person's height.
THIGH, SHIN, ANKLE, SHOULDER = 0.245, 0.225, 0.045, 0.79
STEP, LEAN, BENT, KNEE = 0.21, 0.04, 0.1, 0.8  # rad, of the gait
STANCE, ELBOW = 0.14, 0.42  # rad: of the legs when standing, and of the forearms
HEAD_SHARE = 0.93  # height of the head's centre, share of the person's height
SIDES = np.array([-1.0, 1.0])  # left, right

# Upright parts of the trunk, one row each: centre along and up, then half axes across, along and up; shares of height.
TRUNK = np.array(
    [
        [0.0, 0.67, 0.112, 0.096, 0.19],  # torso
        [0.005, HEAD_SHARE, 0.045, 0.057, 0.07],  # head
        [0.0, 0.795, 0.130, 0.064, 0.05],  # shoulders
        [0.0, 0.52, 0.102, 0.086, 0.10],  # hips
        [0.0, 0.865, 0.032, 0.036, 0.045],  # neck
    ]
)
# Pairs of limbs, left and right: half axes across, along and up, shares of height.
LIMBS = np.array(
    [
        [0.054, 0.060, 0.160],  # thighs
        [0.040, 0.044, 0.150],  # shins
        [0.028, 0.076, 0.026],  # feet
        [0.034, 0.040, 0.110],  # upper arms
        [0.029, 0.032, 0.130],  # forearms with hands
    ]
)
LIMB_PARTS = len(TRUNK) + 2 * len(LIMBS)

WORN = ("coat", "bag", "rucksack", "hat")
# Rows of WORN: centre across, along, up, half axes; shares of height.
WORN_SHAPES = np.array(
    [
        [0.0, 0.0, 0.49, 0.128, 0.112, 0.21],
        [0.165, 0.01, 0.46, 0.035, 0.095, 0.075],
        [0.0, -0.115, 0.70, 0.085, 0.062, 0.125],
        [0.0, 0.008, 0.975, 0.060, 0.078, 0.028],
    ]
)


class Parts(NamedTuple):
    """The K ellipsoids of each of N shapes, in the axes of the shape."""

    offset: Array  # (N, K, 3) m: centres, across, along, up, from the place on the ground
    half: Array  # (N, K, 3) m: half axes, likewise, before the turn by the pitch
    pitch: Array  # (N, K) rad


MAIN, SECOND, DARK = range(3)  # pages of a thing's colours
HELD = ("umbrella", "trolley", "pram")
DISTRACTORS = ("dog", "bicycle", "car", "bollard", "bin", "poster", "sign")
THINGS = (*HELD, *DISTRACTORS)
# Of each part: centre across, along, up; half axes across, along, up, m; pitch, rad; swing, rad; page of colour.
_SHAPES: dict[str, list[tuple[float, ...]]] = {
    "umbrella": [
        (0.08, 0.12, 1.93, 0.52, 0.52, 0.14, 0, 0, MAIN),
        (0.14, 0.14, 1.50, 0.012, 0.012, 0.50, 0, 0, DARK),
    ],
    "trolley": [
        (0.30, -0.42, 0.36, 0.20, 0.13, 0.31, -0.3, 0, MAIN),
        (0.28, -0.24, 0.78, 0.02, 0.02, 0.26, -0.5, 0, DARK),
        (0.30, -0.50, 0.06, 0.20, 0.06, 0.06, 0, 0, DARK),
    ],
    "pram": [
        (0.0, 0.90, 0.62, 0.24, 0.44, 0.20, 0, 0, MAIN),
        (0.0, 1.12, 0.86, 0.24, 0.22, 0.24, 0, 0, SECOND),
        (0.0, 0.45, 0.92, 0.20, 0.02, 0.16, -0.8, 0, DARK),
        (-0.22, 0.62, 0.14, 0.02, 0.14, 0.14, 0, 0, DARK),
        (0.22, 0.62, 0.14, 0.02, 0.14, 0.14, 0, 0, DARK),
        (-0.22, 1.20, 0.14, 0.02, 0.14, 0.14, 0, 0, DARK),
        (0.22, 1.20, 0.14, 0.02, 0.14, 0.14, 0, 0, DARK),
        (0.0, 0.90, 0.34, 0.18, 0.36, 0.04, 0, 0, DARK),
    ],
    "dog": [
        (0.0, 0.0, 0.46, 0.12, 0.36, 0.14, 0, 0, MAIN),
        (0.0, 0.42, 0.66, 0.08, 0.15, 0.10, 0.3, 0, MAIN),
        (0.0, 0.32, 0.56, 0.07, 0.10, 0.15, -0.7, 0, MAIN),
        (-0.07, 0.26, 0.21, 0.04, 0.05, 0.22, 0, 0.4, MAIN),
        (0.07, 0.26, 0.21, 0.04, 0.05, 0.22, 0, -0.4, SECOND),
        (-0.07, -0.26, 0.21, 0.04, 0.06, 0.22, 0, -0.4, SECOND),
        (0.07, -0.26, 0.21, 0.04, 0.06, 0.22, 0, 0.4, MAIN),
        (0.0, -0.46, 0.60, 0.025, 0.025, 0.18, 0.7, 0, SECOND),
    ],
    "bicycle": [
        (0.0, -0.52, 0.34, 0.02, 0.34, 0.34, 0, 0, DARK),
        (0.0, 0.52, 0.34, 0.02, 0.34, 0.34, 0, 0, DARK),
        (0.0, 0.02, 0.80, 0.022, 0.36, 0.025, 0, 0, MAIN),
        (0.0, 0.12, 0.54, 0.022, 0.025, 0.36, -0.75, 0, MAIN),
        (0.0, -0.22, 0.60, 0.02, 0.02, 0.34, 0.3, 0, MAIN),
        (0.0, 0.42, 0.68, 0.02, 0.02, 0.38, 0.25, 0, MAIN),
        (0.0, 0.34, 1.04, 0.28, 0.03, 0.03, 0, 0, SECOND),
        (0.0, -0.32, 0.95, 0.08, 0.14, 0.05, 0, 0, SECOND),
    ],
    "car": [
        (0.0, 0.0, 0.62, 0.88, 2.25, 0.40, 0, 0, MAIN),
        (0.0, -0.25, 1.02, 0.74, 1.30, 0.44, 0, 0, SECOND),
        (0.0, -0.25, 1.16, 0.70, 1.02, 0.32, 0, 0, MAIN),
        (0.0, 0.0, 0.45, 0.84, 2.10, 0.22, 0, 0, DARK),
        (-0.78, 1.35, 0.32, 0.12, 0.32, 0.32, 0, 0, DARK),
        (0.78, 1.35, 0.32, 0.12, 0.32, 0.32, 0, 0, DARK),
        (-0.78, -1.35, 0.32, 0.12, 0.32, 0.32, 0, 0, DARK),
        (0.78, -1.35, 0.32, 0.12, 0.32, 0.32, 0, 0, DARK),
    ],
    "bollard": [
        (0.0, 0.0, 0.45, 0.09, 0.09, 0.52, 0, 0, MAIN),
        (0.0, 0.0, 0.93, 0.10, 0.10, 0.09, 0, 0, SECOND),
    ],
    "bin": [
        (0.0, 0.0, 0.50, 0.30, 0.30, 0.55, 0, 0, MAIN),
        (0.0, 0.0, 0.98, 0.33, 0.33, 0.10, 0, 0, SECOND),
    ],
    "poster": [
        (0.0, 0.0, 1.15, 0.52, 0.03, 0.85, 0, 0, MAIN),
        (0.0, 0.02, 1.20, 0.30, 0.03, 0.42, 0, 0, SECOND),
        (-0.25, 0.0, 0.25, 0.04, 0.04, 0.28, 0, 0, DARK),
        (0.25, 0.0, 0.25, 0.04, 0.04, 0.28, 0, 0, DARK),
    ],
    "sign": [
        (0.0, 0.0, 1.50, 0.045, 0.045, 1.56, 0, 0, DARK),
        (0.0, 0.05, 2.35, 0.32, 0.02, 0.42, 0, 0, MAIN),
    ],
}
THING_PARTS = max(map(len, _SHAPES.values()))
# A thing of fewer parts has small ones within its first part; (kinds, THING_PARTS, 9).
SHAPES = np.array(
    [rows + [(*rows[0][:3], 0.001, 0.001, 0.001, 0, 0, DARK)] * (THING_PARTS - len(rows)) for rows in _SHAPES.values()],
    dtype=float,
)
TOPS = (SHAPES[..., 2] + SHAPES[..., 5]).max(axis=1)  # (kinds,) m: heights


def limbs(height: Array, width: Array, depth: Array, phase: Array, swing: Array) -> Parts:
    """Returns the LIMB_PARTS parts of N people: those of TRUNK, then left and right ones of LIMBS.

    height, width, depth (N,): m. phase (N,): of the gait, rad. swing (N,): 0 standing, 1 at 1.4 m/s.
    """
    leg, beat = phase[:, None] + np.array([0.0, np.pi]), swing[:, None]
    thigh = (STANCE + beat * STEP) * cos(leg) + beat * LEAN
    back = np.maximum(-sin(leg), 0.0)
    shin = thigh - beat * (BENT + KNEE * back * back)
    arm = -0.7 * thigh
    forearm = arm + ELBOW
    toe = 0.7 * shin  # pitch of the foot

    def joint(along: Array, up: Array, reach: float, pitch: Array) -> tuple[Array, Array]:
        return along + reach * sin(pitch), up - reach * cos(pitch)

    none = np.zeros_like(leg)
    hip, shoulder = (none, none + THIGH + SHIN + ANKLE), (none, none + SHOULDER)
    knee, elbow = joint(*hip, THIGH, thigh), joint(*shoulder, 0.18, arm)
    ankle = joint(*knee, SHIN, shin)
    foot = joint(ankle[0] + 0.03 * cos(toe), ankle[1] + 0.03 * sin(toe), 0.02, toe)
    centres = [
        joint(*hip, 0.45 * THIGH, thigh), joint(*knee, 0.5 * SHIN, shin), foot, joint(*shoulder, 0.085, arm),
        joint(*elbow, 0.1, forearm),
    ]  # fmt: skip
    _, long, thick = LIMBS[2]
    sole = foot[1] - length(np.stack([long * sin(toe), thick * cos(toe)], axis=-1))
    n, trunk = len(height), len(TRUNK)
    offset, half, pitch = np.zeros((n, LIMB_PARTS, 3)), np.empty((n, LIMB_PARTS, 3)), np.zeros((n, LIMB_PARTS))
    offset[:, :trunk, 1:], half[:, :trunk] = TRUNK[:, :2], TRUNK[:, 2:]
    broad, deep = (width / (0.27 * height))[:, None], (depth / (0.16 * height))[:, None]
    half[:, [0, 2, 3], 0] *= broad
    half[:, [0, 2, 3], 1] *= deep
    for k, (along, up) in enumerate(centres):
        at = slice(trunk + 2 * k, trunk + 2 * k + 2)
        offset[:, at, 0] = SIDES * (0.052 if k < 3 else 0.127 * broad + 0.010 * (k - 3))
        offset[:, at, 1], offset[:, at, 2], half[:, at] = along, up, LIMBS[k]
        pitch[:, at] = (thigh, shin, toe, arm, forearm)[k]
    offset[..., 2] -= sole.min(axis=1)[:, None]
    return Parts(offset * height[:, None, None], half * height[:, None, None], pitch)


def with_worn(parts: Parts, height: Array, worn: Bools) -> Parts:
    """Returns the parts of N people and, behind them, those of what they wear, (N, 4) in the order of WORN.

    What somebody does not wear is a ball of 1 mm within the first part.
    """
    shape, inner = WORN_SHAPES * height[:, None, None], parts.offset[:, :1]
    shape[..., 2] += parts.offset[:, 1:2, 2] - HEAD_SHARE * height[:, None]  # sinks with the head
    offset = np.where(worn[..., None], shape[..., :3], inner)
    half = np.where(worn[..., None], shape[..., 3:], 0.001)
    added = Parts(offset, half, np.zeros(worn.shape))
    return Parts(*(np.concatenate(pair, axis=1) for pair in zip(parts, added, strict=True)))


def things(kind: Ints, size: Array, phase: Array) -> Parts:
    """Returns the THING_PARTS parts of N things of THINGS. size (N,): scale. phase (N,): of the legs, rad."""
    rows = SHAPES[kind]
    pitch = rows[..., 6] + rows[..., 7] * sin(phase)[:, None]
    return Parts(rows[..., :3] * size[:, None, None], rows[..., 3:6] * size[:, None, None], pitch)
