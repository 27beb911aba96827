"""How large a person is where: box height and width at every foot point of the image (ours).

With a camera: the box of an upright person of mean build (1.7 m) standing there, turned either way. Without: learned
from lone blobs, h = a + b v over the row v of their lower edge, as a pinhole without roll has it: of many lines the one
on which most heights agree, then least squares of relative errors among those within WIDTH of it (a blob of several
people, or of a part, is an outlier); widths are a share of it. Votes prefer the slope SLOPE, since blobs of one row say
nothing about it. A learned size is `reliable` once enough lone blobs agree.
From straight above everybody is the same ellipse, turned as he walks: measured are a blob's axes, not its box's sides.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Camera, Context
from tracking.detect import person_size_kernels as kernels

SLIM = 0.36  # width over height of a walking person's box, the prior of what is learned
STOUT = 2.0  # by how much the width over height of a blob that may be somebody alone differs at most
UNLIKE = 1.4  # by how much his height differs at most from what a camera leads to expect
KEPT = 400  # lone blobs remembered
ENOUGH = 12  # lone blobs that make a learned size reliable ...
AGREE = 0.3  # ... where they are this share of all
RENEW = 0.05  # share of new ones from which on the line is drawn anew
LEVELS = np.geomspace(0.65, 1.55, 19)  # of the median height, and
SLOPES = np.linspace(0.0, 2.4, 17)  # growth per row, times the middle row: where the densest heights are looked for
SLOPE, DOUBT = 0.7, 0.02  # a slope to expect, and the share of votes that unit distance from it costs
WIDTH = 0.12  # relative deviation within which heights agree
FACTORS = np.array([0.9, 0.6]), np.array([1.1, 1.25])  # least and most by which people are higher and wider
NARROW = 0.7  # of the votes for the most frequent width, what a smaller one needs to be taken instead
PRIOR = 2.0  # people who count for the factors 1
EATEN = 1.3  # px of a person's height, at the head, that blur and cleaning leave out: median of rendered scenes
LOOSE = 1.0, 1.1  # height and width of a person's box over those of the box round the ellipse of his pixels: a prior
SMALLEST = 12.0  # px: people less high than this cannot be told from noise,
FLAT = 6.0  # ... and from above people less wide
SHORT, TALL, THIN, WIDE = 0.8, 1.25, 0.5, 1.6  # of a person's height and width: a blob within is one person
PART = 0.6  # SHORT from above, where what is as small can only be part of one, half his colours the shadow's
STEP = 8  # px between the nodes of a camera's table
MARGIN = 0.25  # of the image, beyond which no foot is looked for


class PersonSize:
    """State: a camera's table (2, V, U) of heights and widths, or the line through the lone blobs seen; px.

    seen (K, 4): these blobs' foot u, v, height, width. factor (2,): how much higher and wider than expected they are.
    excess (K, 2): their height and width over those of the box round their ellipse; loose (2,): the median.
    line: a, b. agreed: how many heights agree. unused: blobs seen since the last fit.
    flat (2,): from straight above height and width are the axes of a person's ellipse, px, instead; else None.
    """

    def __init__(self, context: Context) -> None:
        self.table: Array | None = None
        self.flat: Array | None = None
        self.seen = np.zeros((0, 4))  # u, v, h, w of lone blobs
        self.unused = 0
        self.excess, self.loose = np.zeros((0, 2)), np.array(LOOSE)
        self.line, self.factor, self.agreed = (float("nan"), 0.0), np.ones(2), 0
        if context.camera is not None and context.camera.kind == "top":
            self.flat, self.loose = _from_above(context.camera), np.ones(2)
        elif context.camera is not None:
            self.low = -MARGIN * np.array(context.camera.image, float)
            self.table = _table(context.camera, self.low)

    @property
    def reliable(self) -> bool:
        """May this decide how many people a blob holds?"""
        return self.told or self.agreed >= max(ENOUGH, AGREE * len(self.seen))

    @property
    def told(self) -> bool:
        """Does a camera tell how large people are?"""
        return self.table is not None or self.above

    @property
    def above(self) -> bool:
        """Is the camera straight above?"""
        return self.flat is not None

    def at(self, foot: Array) -> Array:
        """(N, 2) height and width in px of a person whose box stands on the image points `foot` (N, 2); nan unknown.

        From above that of a disc, the box of a person turned by 45 degrees.
        """
        size = self._known(foot)
        return np.sqrt(np.square(size).mean(1, keepdims=True) * np.ones(2)) if self.above else size

    def axes(self, foot: Array) -> Array:
        """(N, 2) px: height and width of the ellipse of a person's pixels; from above its axes, the longer first."""
        return self._known(foot) if self.above else self._known(foot) / self.loose

    def _known(self, foot: Array) -> Array:
        size = self._first_guess(foot) * self.factor
        return np.where(size[:, :1] >= (FLAT if self.above else SMALLEST), size, np.nan)

    def one(self, box: Array, ellipse: Array) -> Bools:
        """(M,) are these blobs, boxes ltwh (M, 4) and ellipses (M, 5), of one person's size?"""
        size = ellipse[:, 2:4] if self.above else box[:, :1:-1]
        with np.errstate(invalid="ignore"):
            tall, wide = (size / self._known(_feet(box))).T
            return np.asarray(
                (tall >= (PART if self.above else SHORT)) & (tall <= TALL) & (wide >= THIN) & (wide <= WIDE)
            )

    def _first_guess(self, foot: Array) -> Array:
        if self.flat is not None:
            return np.tile(self.flat, (len(foot), 1))
        if self.table is not None:
            return kernels.look_up(self.table, (foot - self.low) / STEP)
        height = self.line[0] + self.line[1] * foot[:, 1]
        return np.stack([height, SLIM * height], 1)

    @property
    def px_per_m(self) -> float:
        """Scale of the image: the median height of the lone blobs seen / 1.7 m; nan without any."""
        return float(np.median(self.seen[:, 2])) / PERSON_HEIGHT if len(self.seen) else float("nan")

    def learn(self, box: Array, ellipse: Array, whole: Bools) -> None:
        """Add the blobs (M, 4) ltwh, (M, 5), that may be somebody alone; `whole` (M,): away from the image's edge."""
        foot, size = _feet(box), ellipse[:, 2:4] if self.above else box[:, :1:-1]
        expected = np.divide(*self._first_guess(foot).T[::-1]) if self.told else SLIM
        with np.errstate(invalid="ignore"):
            slim = np.abs(np.log(size[:, 1] / size[:, 0] / expected)) <= np.log(STOUT)
        good = whole & slim & (size[:, 0] >= (FLAT if self.above else SMALLEST)) & self._likely(foot, size)
        if not good.any():
            return
        size, foot = size[good], foot[good]
        if not self.above:
            size = size + np.array([EATEN, 0.0])
            round_ellipse = upright(ellipse[good, :4], ellipse[good, 4])[:, 2:]
            self.excess = np.concatenate([self.excess, size / round_ellipse])[-KEPT:]
            self.loose = np.median(np.concatenate([self.excess, np.tile(LOOSE, (ENOUGH, 1))]), 0)
        new = np.concatenate([foot, size], 1)
        self.seen, self.unused = np.concatenate([self.seen, new])[-KEPT:], self.unused + len(new)
        if self.unused >= RENEW * len(self.seen):
            self.unused = 0
            self._fit()

    def _likely(self, foot: Array, size: Array) -> Bools:
        """(M,) are these as high as somebody may be of whom a camera tells how high? Specks are nobody."""
        if not self.told:
            return np.ones(len(size), bool)
        with np.errstate(invalid="ignore"):
            off = np.abs(np.log(size[:, 0] / self._first_guess(foot)[:, 0]))
        return np.asarray(off <= np.log(UNLIKE))

    def _fit(self) -> None:
        """Where most heights agree: the line, if there is no camera, and the factors of height and width."""
        foot, height = self.seen[:, :2], self.seen[:, 2]
        typical = float(np.median(height))
        count = height / typical / _crowding(foot / typical)
        if not self.told:
            self.line = _line(foot[:, 1], height, count)
        ratio = self.seen[:, 2:] / np.maximum(self._first_guess(foot), 1.0)
        known = np.isfinite(ratio).all(1)
        ratio, count = ratio[known], count[known]
        tall, agreed = _densest(ratio[:, 0], count)
        wide, _ = _densest(ratio[agreed, 1], count[agreed], NARROW)
        self.agreed, self.factor = int(agreed.sum()), np.clip([tall, wide], *FACTORS)


def upright(place: Array, angle: Array) -> Array:
    """(N, 4) box x, y, h, w round ellipses of centre and axes `place` (N, 4), the first at `angle` (N,) rad."""
    box, c, s = place.copy(), np.square(np.cos(angle)), np.square(np.sin(angle))
    first, second = np.square(place[:, 2]), np.square(place[:, 3])
    box[:, 2], box[:, 3] = np.sqrt(first * s + second * c), np.sqrt(first * c + second * s)
    return box


def _feet(box: Array) -> Array:
    """(M, 2) where boxes ltwh stand."""
    return np.stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3]], 1)


def _densest(value: Array, count: Array, least: float = 1.0) -> tuple[float, Bools]:
    """The value (N,) within relative WIDTH of which most counts lie, PRIOR more at 1; which ones (N,) lie there.

    least: the smallest value that has this share of the most (one person is narrower than two).
    """
    value, count = np.append(value, 1.0), np.append(count, PRIOR)
    near = np.abs(value / np.maximum(value[:, None], 1e-9) - 1) <= WIDTH
    votes = near @ count
    enough = np.flatnonzero(votes >= least * votes.max())
    members = near[enough[int(value[enough].argmin())]] if least < 1 else near[int(votes.argmax())]
    return float(np.average(value[members], weights=count[members])), members[:-1]


def _line(v: Array, h: Array, count: Array) -> tuple[float, float]:
    """h = a + b v where most heights agree: the best of many lines, then least squares among those that agree."""
    middle, typical = max(float(np.median(v)), 1.0), float(np.median(h))
    at = v / middle - 1
    level, slope = (a.ravel() for a in np.meshgrid(LEVELS, SLOPES))
    off = h / typical / np.maximum(level[:, None] * (1 + slope[:, None] * at), 0.05) - 1
    votes = np.maximum(1 - np.square(off / WIDTH), 0) @ count - DOUBT * count.sum() * np.square(slope - SLOPE)
    best = int(votes.argmax())
    line = first = typical * level[best] * np.array([1.0, slope[best]])
    tie = np.diag([0.0, 0.01]) * count.sum()
    for _ in range(3):
        fit = np.maximum(line[0] + line[1] * at, 1.0)
        weight = count * (np.abs(h / fit - 1) <= WIDTH) * np.square(typical / fit)
        x = np.stack([np.ones_like(at), at])
        line = np.linalg.solve((x * weight) @ x.T + tie, (x * weight) @ h + tie @ first)
    return float(line[0] - line[1]), float(line[1] / middle)


def _crowding(place: Array) -> Array:
    """(N,) how many of the places (N, 2), in person heights, share a cell: who stands still counts once."""
    cell = np.floor(4 * place).astype(np.int64)
    _, which, count = np.unique(cell[:, 0] * 100_003 + cell[:, 1], return_inverse=True, return_counts=True)
    return np.asarray(count[which], float)


def _table(camera: Camera, low: Array) -> Array:
    """(2, V, U) height and width at nodes STEP px apart from `low` on; nan where nobody can stand."""
    from sim.scene.body import person_boxes
    from sim.scene.camera import to_ground

    size = (np.array(camera.image) * (1 + 2 * MARGIN) / STEP).astype(int) + 2
    u, v = np.meshgrid(low[0] + STEP * np.arange(size[0]), low[1] + STEP * np.arange(size[1]))
    foot = np.stack([u.ravel(), v.ravel()], 1)
    found, aim = np.full((len(foot), 2), np.nan), foot.copy()
    for _ in range(3):  # the ground point is where the box's lower edge is only if seen from the side
        ground = to_ground(camera, aim)
        seen = np.isfinite(ground).all(1)
        if not seen.any():
            break
        place = np.column_stack([ground[seen], np.zeros(int(seen.sum()))])
        turned = [
            person_boxes(camera, place, np.full(len(place), a), np.full(len(place), PERSON_HEIGHT)) for a in _TURNS
        ]
        box = np.mean(turned, 0)
        found[seen] = box[:, :1:-1]
        aim[seen] += np.nan_to_num(foot[seen] - _feet(box))
    return np.asarray(found.T.reshape(2, size[1], size[0]))


def _from_above(camera: Camera) -> Array:
    """(2,) longer and shorter axis of a person, px."""
    from sim.scene.body import person_boxes

    return np.sort(person_boxes(camera, np.zeros((1, 3)), np.zeros(1), np.array([PERSON_HEIGHT]))[0, 2:])[::-1]


_TURNS = np.radians([0.0, 45.0, 90.0, 135.0])
