"""Errors of a detector's boxes (left, top, width, height in px), as `scenarios.schema.sensor.BoxNoise` describes them.

The four errors of a box are, in order: middle to the right, foot (lower edge) downwards, top edge downwards, all three
divided by the box height; and the logarithm of the width over the true width. `perturb_boxes` applies them,
`box_errors` measures them. `move_edges` moves each edge by px; `seen_shift` gives the error of a foot point if a part
of the person is hidden.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sim.detector.visible_ground import furthest_row
from sim.elementary import cos, exp, log, power
from sim.scene.camera import foot_points
from sim.schedules import values_at
from sim.types import Array, Camera

if TYPE_CHECKING:
    from scenarios.schema.sensor import BoxNoise

GRID, FURTHEST = 1 / 64, 8.3125  # of the table of `heavy_tailed`


def perturb_boxes(box: Array, visibility: Array, noise: BoxNoise, n: Array, t: Array | None = None) -> Array:
    """Returns boxes (R, 4), left, top, width, height in px, moved by random errors; the boxes given are not changed.

    n (R, 4): standard normals for the errors of the middle (to the right), the foot (downwards), the top (downwards),
    all in box heights, and of the logarithm of the width. An error is mean + standard deviation × n; `noise` holds this
    pair as across, foot, top and width. The standard deviation is multiplied by 1 + `noise.occluded` × hidden share; of
    middle, foot and top it is at least `noise.floor_px`. All errors are multiplied by `noise.scale`. `noise.tails`, an
    excess kurtosis, gives n heavier tails. visibility (R,): visible share of each person, 0 to 1. t (R,): times, s, for
    a `scale` that changes; None: all 0.

    Width and height keep at least 1 px, or their former value if that was less; the middle and the foot stay where the
    errors put them. A nan box stays nan. If `noise.scale` is 0, `box` itself is returned.
    """
    if not noise.scale:
        return box
    n = heavy_tailed(n, noise.tails)
    means, sds = np.array([noise.across, noise.foot, noise.top, noise.width]).T
    sd = sds * (1.0 + noise.occluded * (1.0 - visibility))[:, None]
    left, top, w, h = box.T
    px = means[:3] * h[:, None] + np.maximum(sd[:, :3] * h[:, None], noise.floor_px) * n[:, :3]
    scale = values_at(noise.scale, np.zeros(len(box)) if t is None else t)
    across, down, top_down = scale * px.T
    wider = scale * (means[3] + sd[:, 3] * n[:, 3])
    middle, foot, top = left + w / 2 + across, top + h + down, top + top_down
    width, height = w * exp(wider), foot - top
    width, height = np.maximum(width, np.minimum(w, 1.0)), np.maximum(height, np.minimum(h, 1.0))
    return np.stack([middle - width / 2, foot - height, width, height], axis=1)


def move_edges(box: Array, move: Array) -> Array:
    """Returns boxes (R, 4), left, top, width, height in px, whose edges are moved by move (R, 4) px.

    Columns of move: left edge, top edge, right edge, lower edge; positive is to the right or downwards. Width and
    height keep at least 1 px, or their former value if that was less: the right or lower edge is moved less for this.
    """
    edges = np.concatenate([box[:, :2], box[:, :2] + box[:, 2:]], axis=1) + move
    size = np.maximum(edges[:, 2:] - edges[:, :2], np.minimum(box[:, 2:], 1.0))
    return np.concatenate([edges[:, :2], size], axis=1)


def heavy_tailed(n: Array, excess_kurtosis: float) -> Array:
    """Returns standard normals n, of any shape, mapped to numbers of Student's t distribution scaled to variance 1.

    excess_kurtosis: that of the distribution, 0 or more.

    Quantiles are mapped to quantiles, with 4 + 6 / kurtosis degrees of freedom, to 0.1 % up to n = 5; n beyond 8.3
    counts as 8.3. If the excess kurtosis is 0, n itself is returned, not a copy.
    """
    if not excess_kurtosis:
        return n
    freedom = 4.0 + 6.0 / excess_kurtosis
    t, slope = _t_of_normal(freedom)
    place = np.minimum(np.abs(n), FURTHEST) / GRID
    k = np.minimum(place.astype(np.int64), len(t) - 2)
    s = place - k
    rise = t[k + 1] - t[k]
    first, last = GRID * slope[k] - rise, GRID * slope[k + 1] - rise
    student = t[k] + s * rise + s * (1.0 - s) * ((1.0 - s) * first - s * last)  # the cubic of both values and slopes
    return np.asarray(np.where(n < 0.0, -student, student) * np.sqrt((freedom - 2.0) / freedom))


@cache
def _t_of_normal(freedom: float) -> tuple[Array, Array]:
    """Returns Student's t at the quantiles of standard normals 0, GRID, 2 GRID, … FURTHEST, and its slopes there.

    t(n) obeys dt/dn = phi(n) / f(t) with the two densities; it is integrated by Runge and Kutta's method of order 4.
    """
    angle = (np.arange(2000) + 0.5) * (np.pi / 4000)
    mass = np.sum(power(cos(angle), freedom - 1.0)) * (np.pi / 4000)  # of (1 + t²/freedom)^-((freedom + 1)/2), t > 0
    ratio = float(np.sqrt(freedom) * mass / np.sqrt(np.pi / 2))

    def slope(n: float, t: float) -> float:
        return ratio * float(exp(0.5 * (freedom + 1.0) * log(1.0 + t * t / freedom) - 0.5 * n * n))

    made = [(0.0, ratio)]
    for k in range(round(FURTHEST / GRID)):
        n, (t, a) = k * GRID, made[-1]
        b = slope(n + GRID / 2, t + GRID / 2 * a)
        c = slope(n + GRID / 2, t + GRID / 2 * b)
        t += GRID / 6 * (a + 2 * b + 2 * c + slope(n + GRID, t + GRID * c))
        made.append((t, slope(n + GRID, t)))
    table = np.array(made)
    return table[:, 0], table[:, 1]


def box_errors(box: Array, true: Array) -> Array:
    """Returns the errors (R, 4) of boxes (R, 4) against the true boxes (R, 4), both left, top, width, height in px.

    Columns: middle to the right, foot downwards, top downwards, each divided by the true height; and the logarithm of
    width over true width. These are the errors that `perturb_boxes` adds. A true height or width of 0 gives inf or nan,
    with a numpy warning.
    """
    h = true[:, 3]
    foot, true_foot = box[:, 1] + box[:, 3], true[:, 1] + h
    middle, true_middle = box[:, 0] + box[:, 2] / 2, true[:, 0] + true[:, 2] / 2
    across, low, high = (middle - true_middle) / h, (foot - true_foot) / h, (box[:, 1] - true[:, 1]) / h
    return np.stack([across, low, high, log(box[:, 2] / true[:, 2])], axis=1)


def seen_shift(box: Array, whole: Array, z: Array, camera: Camera) -> Array:
    """Returns by how many m (R, 2), along x and y, a person's foot point is displaced by what hides the person.

    It is the foot point of box (R, 4), the box of the visible part, less the foot point of whole (R, 4), the box of the
    whole body; both left, top, width, height in px. z (R,) m: height of the ground, as for `foot_points`. A lower edge
    of `box` above `furthest_row`, where people become small, is first moved down to this row, but not below the lower
    edge of `whole`. For a camera of kind "top" it is not moved. A row is 0 if both boxes are equal, and where one of
    the feet shows no ground.
    """
    lowest = -np.inf if camera.kind == "top" else furthest_row(camera)
    foot, true_foot = box[:, 1] + box[:, 3], whole[:, 1] + whole[:, 3]
    lowered = box.copy()
    lowered[:, 3] += np.maximum(np.minimum(true_foot, lowest) - foot, 0.0)
    shift = foot_points(lowered, z, camera) - foot_points(whole, z, camera)
    return np.where(np.isfinite(shift), shift, 0.0)
