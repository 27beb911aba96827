"""The size of a person in the image: height and width of a person's box at every foot point (ours).

Three sources:
- A pinhole camera. The box of an upright typical person (typical_person) who stands at the foot point.
- A camera straight above. Everybody is the same ellipse, turned with the heading; its axes are used instead of the box.
- No camera. Learned from lone blobs (blobs that may be one person each): the height is a line h = a + b v over the row
  v of the foot, as in a pinhole without roll; the width is SLIM times the height. The line is the one of many on which
  most heights agree, refined by least squares of relative errors. So blobs of several people or of parts of people are
  outliers. Votes prefer the slope SLOPE, as blobs at one row contain no information about it.
In all three cases height and width are then multiplied by factors on which most lone blobs agree.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Camera, Context
from tracking.detect.typical_person import axes_from_above, boxes

SLIM = 0.36  # width over height of a walking person's box: the first guess without a camera
ASPECT_FACTOR = 2.0  # largest factor between a lone blob's width over height and the expected one
HEIGHT_FACTOR = 1.4  # largest factor between a lone blob's height and the one that a camera leads to expect
KEPT = 400  # lone blobs remembered
ENOUGH = 12  # a learned size is reliable if at least so many lone blobs agree ...
AGREE_SHARE = 0.3  # ... and at least this share of all
REFIT_SHARE = 0.05  # share of new lone blobs from which on line and factors are computed anew
LEVELS = np.geomspace(0.65, 1.55, 19)  # heights at the middle row, of the median height, and
SLOPES = np.linspace(0.0, 2.4, 17)  # relative growth of the height from row 0 to the middle row: lines that are tried
SLOPE, SLOPE_COST = 0.7, 0.02  # expected slope, and the share of votes that a squared distance of 1 from it costs
AGREEMENT = 0.12  # two sizes agree if they differ by at most this share
FACTORS = np.array([0.9, 0.6]), np.array([1.1, 1.25])  # least and largest factors of height and width
WIDEST = 1.5  # largest factor of the width with a pinhole camera: people with bags, in mid-stride
NARROWER_SHARE = 0.7  # a smaller width wins over the most frequent one if it has this share of its votes
PRIOR_COUNT = 2.0  # lone blobs that the factor 1 counts for
CLEANED_AWAY = 1.3  # px of a person's height that blur and cleaning remove at the head: median over rendered scenes
BOX_OVER_ELLIPSE = 1.0, 1.1  # height and width of a person's box over those of the box round the person's ellipse
SMALLEST = 12.0  # px: a person less high cannot be distinguished from noise;
SMALLEST_FROM_ABOVE = 6.0  # px: from straight above a person whose longer axis is shorter
SHORT, TALL, THIN, WIDE = 0.8, 1.25, 0.5, 1.6  # limits of one person's height and width relative to the expected ones
SHORT_FROM_ABOVE = 0.6  # SHORT from straight above, where half of a person can have the colour of a shadow
STEP = 8  # px between the nodes of a camera's table
MARGIN = 0.25  # the table reaches so far beyond the image, in image sizes


class PersonSize:
    """The size of a person in the image at every foot point: from a camera if there is one, corrected by lone blobs.

    State ("lone blobs" may be one person each; "from above": the camera is straight above):
    table (2, V, U)         with a pinhole camera: height and width at the nodes of a grid of 8 px, px; else None
    low (2,)                u, v of the grid's first node, px; only with a table
    axes_above (2,)         from above: longer and shorter axis of a person's ellipse, px; else None
    lone (K, 4)             the last lone blobs, at most 400: foot u, v, height + 1.3, width, px (from above: the axes)
    since_fit, agreed       numbers of lone blobs: since the last fit; of heights that agree with line and factor
    line                    a (px), b of h = a + b v, v the foot's row; used without a camera; a is nan before a fit
    factor (2,)             height and width of the lone blobs over the expected ones; 1 before the first fit
    box_ratios (K, 2)       height and width of the lone blobs' boxes over those of the boxes round their ellipses
    box_over_ellipse (2,)   their median (with a prior of 1.0, 1.1); 1 from above"""

    def __init__(self, context: Context) -> None:
        self.table: Array | None = None
        self.axes_above: Array | None = None
        self.lone = np.zeros((0, 4))
        self.since_fit = 0
        self.box_ratios, self.box_over_ellipse = np.zeros((0, 2)), np.array(BOX_OVER_ELLIPSE)
        self.line, self.factor, self.agreed = (float("nan"), 0.0), np.ones(2), 0
        if context.camera is not None and context.camera.kind == "top":
            self.axes_above, self.box_over_ellipse = axes_from_above(context.camera), np.ones(2)
        elif context.camera is not None:
            self.low = -MARGIN * np.array(context.camera.image, float)
            self.table = _table(context.camera, self.low)

    @property
    def reliable(self) -> bool:
        """True if the size may decide how many people a blob holds: always with a camera, else if at least 12 lone
        blobs, which are at least 30 % of all remembered ones, agree with the learned height."""
        return self.from_camera or self.agreed >= max(ENOUGH, AGREE_SHARE * len(self.lone))

    @property
    def from_camera(self) -> bool:
        """True if the context had a camera (pinhole or straight above), so that sizes come from it."""
        return self.table is not None or self.above

    @property
    def above(self) -> bool:
        """True if the camera looks straight down; sizes are then the axes of an ellipse."""
        return self.axes_above is not None

    def at(self, foot: Array) -> Array:
        """Returns height and width (N, 2), px, of the box of a person who stands at image points `foot` (N, 2) u, v,
        px."""
        size = self._expected(foot)
        return np.sqrt(np.square(size).mean(1, keepdims=True) * np.ones(2)) if self.above else size

    def axes(self, foot: Array) -> Array:
        """Returns height and width (N, 2), px, of the ellipse of a person who stands at `foot` (N, 2) u, v, px."""
        return self._expected(foot) if self.above else self._expected(foot) / self.box_over_ellipse

    def _expected(self, foot: Array) -> Array:
        size = self._unscaled(foot) * self.factor
        return np.where(size[:, :1] >= (SMALLEST_FROM_ABOVE if self.above else SMALLEST), size, np.nan)

    def one_person(self, box: Array, ellipse: Array) -> Bools:
        """Returns True for each blob (M,) that has the size of one person; False where a person's size is unknown or
        too small (nan)."""
        size = ellipse[:, 2:4] if self.above else box[:, :1:-1]
        with np.errstate(invalid="ignore"):
            tall, wide = (size / self._expected(_feet(box))).T
            short = SHORT_FROM_ABOVE if self.above else SHORT
            return np.asarray((tall >= short) & (tall <= TALL) & (wide >= THIN) & (wide <= WIDE))

    def _unscaled(self, foot: Array) -> Array:
        if self.axes_above is not None:
            return np.tile(self.axes_above, (len(foot), 1))
        if self.table is not None:
            return look_up(self.table, (foot - self.low) / STEP)
        height = self.line[0] + self.line[1] * foot[:, 1]
        return np.stack([height, SLIM * height], 1)

    @property
    def px_per_m(self) -> float:
        """Scale of the image, px per m: the median height of the remembered lone blobs (each may be one person) over
        1.7 m."""
        return float(np.median(self.lone[:, 2])) / PERSON_HEIGHT if len(self.lone) else float("nan")

    def learn(self, box: Array, ellipse: Array, whole: Bools) -> None:
        """Learns the size, in place, from the blobs of a picture that may be one person; other blobs are ignored. box
        (M, 4), ellipse (M, 5): as of `Blobs`; whole (M,): False for blobs that are cut and do not count."""
        foot, size = _feet(box), ellipse[:, 2:4] if self.above else box[:, :1:-1]
        expected = np.divide(*self._unscaled(foot).T[::-1]) if self.from_camera else SLIM
        with np.errstate(invalid="ignore"):
            slim = np.abs(np.log(size[:, 1] / size[:, 0] / expected)) <= np.log(ASPECT_FACTOR)
        large = size[:, 0] >= (SMALLEST_FROM_ABOVE if self.above else SMALLEST)
        good = whole & slim & large & self._plausible_height(foot, size)
        if not good.any():
            return
        size, foot = size[good], foot[good]
        if not self.above:
            size = size + np.array([CLEANED_AWAY, 0.0])
            round_ellipse = upright(ellipse[good, :4], ellipse[good, 4])[:, 2:]
            self.box_ratios = np.concatenate([self.box_ratios, size / round_ellipse])[-KEPT:]
            prior = np.tile(BOX_OVER_ELLIPSE, (ENOUGH, 1))
            self.box_over_ellipse = np.median(np.concatenate([self.box_ratios, prior]), 0)
        new = np.concatenate([foot, size], 1)
        self.lone, self.since_fit = np.concatenate([self.lone, new])[-KEPT:], self.since_fit + len(new)
        if self.since_fit >= REFIT_SHARE * len(self.lone):
            self.since_fit = 0
            self._fit()

    def _plausible_height(self, foot: Array, size: Array) -> Bools:
        if not self.from_camera:
            return np.ones(len(size), bool)
        with np.errstate(invalid="ignore"):
            off = np.abs(np.log(size[:, 0] / self._unscaled(foot)[:, 0]))
        return np.asarray(off <= np.log(HEIGHT_FACTOR))

    def _fit(self) -> None:
        foot, height = self.lone[:, :2], self.lone[:, 2]
        typical = float(np.median(height))
        weight = height / typical / _crowding(foot / typical)
        if not self.from_camera:
            self.line = _line(foot[:, 1], height, weight)
        ratio = self.lone[:, 2:] / np.maximum(self._unscaled(foot), 1.0)
        known = np.isfinite(ratio).all(1)
        ratio, weight = ratio[known], weight[known]
        tall, agreed = _densest(ratio[:, 0], weight)
        wide, _ = _densest(ratio[agreed, 1], weight[agreed], NARROWER_SHARE)
        most = FACTORS[1] if self.table is None else np.array([FACTORS[1][0], WIDEST])
        self.agreed, self.factor = int(agreed.sum()), np.clip([tall, wide], FACTORS[0], most)


def look_up(table: Array, at: Array) -> Array:
    """Returns bilinearly interpolated values (N, C) of a table (C, V, U) at N points; V and U must be at least 2.

    at (N, 2): u, v in grid steps from the table's first node. A coordinate outside the table is moved to its edge; a
    nan coordinate counts as 0. A nan among the four nodes round a point gives nan.
    """
    x, y = np.clip(np.nan_to_num(at, nan=0.0), 0.0, np.array(table.shape[:0:-1]) - 1.001).T
    u, v = x.astype(int), y.astype(int)
    a, b = x - u, y - v
    low = table[:, v, u] * (1 - a) + table[:, v, u + 1] * a
    high = table[:, v + 1, u] * (1 - a) + table[:, v + 1, u + 1] * a
    return np.asarray((low * (1 - b) + high * b).T)


def upright(place: Array, angle: Array) -> Array:
    """Returns the bounding boxes (N, 4) of ellipses: centre x, y, height, width, in the unit of `place`."""
    box, c, s = place.copy(), np.square(np.cos(angle)), np.square(np.sin(angle))
    first, second = np.square(place[:, 2]), np.square(place[:, 3])
    box[:, 2], box[:, 3] = np.sqrt(first * s + second * c), np.sqrt(first * c + second * s)
    return box


def _feet(box: Array) -> Array:
    return np.stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3]], 1)


def _densest(value: Array, weight: Array, least: float = 1.0) -> tuple[float, Bools]:
    value, weight = np.append(value, 1.0), np.append(weight, PRIOR_COUNT)
    near = np.abs(value / np.maximum(value[:, None], 1e-9) - 1) <= AGREEMENT
    votes = near @ weight
    enough = np.flatnonzero(votes >= least * votes.max())
    members = near[enough[int(value[enough].argmin())]] if least < 1 else near[int(votes.argmax())]
    return float(np.average(value[members], weights=weight[members])), members[:-1]


def _line(v: Array, h: Array, weight: Array) -> tuple[float, float]:
    middle, typical = max(float(np.median(v)), 1.0), float(np.median(h))
    at = v / middle - 1
    level, slope = (a.ravel() for a in np.meshgrid(LEVELS, SLOPES))
    off = h / typical / np.maximum(level[:, None] * (1 + slope[:, None] * at), 0.05) - 1
    cost = SLOPE_COST * weight.sum() * np.square(slope - SLOPE)
    votes = np.maximum(1 - np.square(off / AGREEMENT), 0) @ weight - cost
    best = int(votes.argmax())
    line = first = typical * level[best] * np.array([1.0, slope[best]])
    tie = np.diag([0.0, 0.01]) * weight.sum()
    for _ in range(3):
        fit = np.maximum(line[0] + line[1] * at, 1.0)
        w = weight * (np.abs(h / fit - 1) <= AGREEMENT) * np.square(typical / fit)
        x = np.stack([np.ones_like(at), at])
        line = np.linalg.solve((x * w) @ x.T + tie, (x * w) @ h + tie @ first)
    return float(line[0] - line[1]), float(line[1] / middle)


def _crowding(place: Array) -> Array:
    cell = np.floor(4 * place).astype(np.int64)
    _, which, count = np.unique(cell[:, 0] * 100_003 + cell[:, 1], return_inverse=True, return_counts=True)
    return np.asarray(count[which], float)


def _table(camera: Camera, low: Array) -> Array:
    from sim.scene.camera import to_ground

    size = (np.array(camera.image) * (1 + 2 * MARGIN) / STEP).astype(int) + 2
    u, v = np.meshgrid(low[0] + STEP * np.arange(size[0]), low[1] + STEP * np.arange(size[1]))
    foot = np.stack([u.ravel(), v.ravel()], 1)
    found, aim = np.full((len(foot), 2), np.nan), foot.copy()
    for _ in range(3):
        ground = to_ground(camera, aim)
        seen = np.isfinite(ground).all(1)
        if not seen.any():
            break
        box = boxes(camera, ground[seen])
        found[seen] = box[:, :1:-1]
        aim[seen] += np.nan_to_num(foot[seen] - _feet(box))
    return np.asarray(found.T.reshape(2, size[1], size[0]))
