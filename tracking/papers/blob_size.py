"""How large a person is where: box height and width at every foot point of the image, for `blob` from pixels (ours).

With a camera: the box of an upright person of mean build (1.7 m) standing there, turned either way. Without: learned
from lone blobs, h = a + b v over the row v of their lower edge, as a pinhole without roll has it, by least squares in
relative errors with Cauchy weights (a blob of several people, or of a part, is an outlier); widths are a share of it.
The slope has a prior, since blobs of one row say nothing about it. A learned size is `reliable` once enough lone blobs
agree; before that nothing is split and every blob counts as one person, as in the paper.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Camera, Context
from tracking.papers import blob_measure

PERSON = 1.7  # m
SLIM = 0.36  # width over height of a walking person's box, the prior of what is learned
UPRIGHT = (1.5, 5.0)  # height over width of a blob that may be somebody alone
KEPT = 400  # lone blobs remembered
ENOUGH = 12  # lone blobs that make a learned size reliable ...
RENEW = 0.05  # share of new ones from which on the line is drawn anew
AGREE = 0.3  # ... where they are this share of all
LEVELS = np.geomspace(0.65, 1.55, 19)  # of the median height, and
SLOPES = np.linspace(0.0, 2.4, 17)  # growth per row, times the middle row: where the densest heights are looked for
SLOPE, DOUBT = 0.7, 0.02  # a slope to expect, and the share of votes that unit distance from it costs
WIDTH = 0.12  # relative deviation within which heights agree
LOOSE = 1.0, 1.1  # height and width of a person's box over those of the box round the ellipse of his pixels: a prior
SMALLEST = 12.0  # px: people less high than this cannot be told from noise
STEP = 8  # px between the nodes of a camera's table
MARGIN = 0.25  # of the image, beyond which no foot is looked for


class PersonSize:
    """State: a camera's table (2, V, U) of heights and widths, or the lone blobs seen and the line through them."""

    def __init__(self, context: Context) -> None:
        self.table: Array | None = None
        self.seen = np.zeros((0, 4))  # u, v, h, w of lone blobs
        self.unused = 0
        self.excess, self.loose = np.zeros((0, 2)), np.array(LOOSE)
        self.line, self.slim, self.agreed = (float("nan"), 0.0), SLIM, 0
        if context.camera is not None:
            self.low = -MARGIN * np.array(context.camera.image, float)
            self.table = _table(context.camera, self.low)

    @property
    def reliable(self) -> bool:
        """May this decide how many people a blob holds?"""
        return self.table is not None or self.agreed >= max(ENOUGH, AGREE * len(self.seen))

    def at(self, foot: Array) -> Array:
        """(N, 2) height and width in px of a person whose box stands on the image points `foot` (N, 2); nan unknown."""
        if self.table is not None:
            size = _look_up(self.table, (foot - self.low) / STEP)
        else:
            height = self.line[0] + self.line[1] * foot[:, 1]
            size = np.stack([height, self.slim * height], 1)
        return np.where(size[:, :1] >= SMALLEST, size, np.nan)

    @property
    def px_per_m(self) -> float:
        """Scale of the image: the median height of the lone blobs seen / 1.7 m; nan without any."""
        return float(np.median(self.seen[:, 2])) / PERSON if len(self.seen) else float("nan")

    def learn(self, box: Array, ellipse: Array, whole: Bools) -> None:
        """Add the blobs (M, 4) ltwh, (M, 5), that may be somebody alone; `whole` (M,): away from the image's edge."""
        ratio = box[:, 3] / np.maximum(box[:, 2], 1.0)
        good = whole & (ratio >= UPRIGHT[0]) & (ratio <= UPRIGHT[1])
        if not good.any():
            return
        alone = box[good]
        round_ellipse = blob_measure.upright(ellipse[good, :4], ellipse[good, 4])[:, 2:]
        self.excess = np.concatenate([self.excess, alone[:, :1:-1] / round_ellipse])[-KEPT:]
        self.loose = np.median(np.concatenate([self.excess, np.tile(LOOSE, (ENOUGH, 1))]), 0)
        if self.table is not None:
            return
        new = np.stack([alone[:, 0] + alone[:, 2] / 2, alone[:, 1] + alone[:, 3], alone[:, 3], alone[:, 2]], 1)
        self.seen, self.unused = np.concatenate([self.seen, new])[-KEPT:], self.unused + len(new)
        if self.unused >= RENEW * len(self.seen):
            self.unused = 0
            self._fit()

    def _fit(self) -> None:
        """The line through the densest heights, and the share of height that is width."""
        u, v, h, w = self.seen.T
        middle, typical = float(np.median(v)), float(np.median(h))
        at, count = (v - middle) / max(middle, 1.0), 1 / _crowding(np.stack([u, v], 1) / typical)
        level, slope = (a.ravel() for a in np.meshgrid(LEVELS, SLOPES))
        off = h / typical / np.maximum(level[:, None] * (1 + slope[:, None] * at), 0.05) - 1
        votes = np.maximum(1 - np.square(off / WIDTH), 0) @ count - DOUBT * count.sum() * np.square(slope - SLOPE)
        best = int(votes.argmax())
        line = typical * level[best] * np.array([1.0, slope[best]])
        prior = line[1]
        for _ in range(3):
            fit = np.maximum(line[0] + line[1] * at, 1.0)
            weight = count * (np.abs(h / fit - 1) <= WIDTH) / (fit * fit)
            line = np.array(_line(at, h, weight, prior, 0.01 * float(weight.sum()) * typical**2))
        fit = np.maximum(line[0] + line[1] * at, 1.0)
        inlier = np.abs(h / fit - 1) <= WIDTH
        self.line = (float(line[0] - line[1] * middle / max(middle, 1.0)), float(line[1] / max(middle, 1.0)))
        self.agreed = int(inlier.sum())
        slim = np.append(w[inlier] / h[inlier], np.full(4, SLIM))
        self.slim = float(np.clip(np.median(slim), 0.2, 0.8))


def _crowding(place: Array) -> Array:
    """(N,) how many of the places (N, 2), in person heights, share a cell: who stands still counts once."""
    cell = np.floor(4 * place).astype(np.int64)
    _, which, count = np.unique(cell[:, 0] * 100_003 + cell[:, 1], return_inverse=True, return_counts=True)
    return np.asarray(count[which], float)


def _line(v: Array, h: Array, weight: Array, prior: float, strength: float) -> tuple[float, float]:
    """Weighted least squares of h = level + slope v, the slope tied to `prior` by a deviation of its own size."""
    tie = strength / max(prior, 0.1 * float(h.mean())) ** 2
    moments = np.array([[weight.sum(), weight @ v], [weight @ v, weight @ (v * v) + tie]])
    level, slope = np.linalg.solve(moments, np.array([weight @ h, weight @ (v * h) + tie * prior]))
    return float(level), float(slope)


def _table(camera: Camera, low: Array) -> Array:
    """(2, V, U) height and width at nodes STEP px apart from `low` on; nan where nobody can stand."""
    from sim.camera import to_ground
    from sim.people import boxes

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
        turned = [boxes(camera, place, np.full(len(place), a), np.full(len(place), PERSON)) for a in _TURNS]
        box = np.mean(turned, 0)
        found[seen] = box[:, :1:-1]
        stands = np.stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3]], 1)
        aim[seen] += np.nan_to_num(foot[seen] - stands)
    return np.asarray(found.T.reshape(2, size[1], size[0]))


_TURNS = np.radians([0.0, 45.0, 90.0, 135.0])


def _look_up(table: Array, at: Array) -> Array:
    """(N, 2) bilinear values of a table (2, V, U) at nodes' coordinates (u, v) (N, 2), clamped to its ends."""
    top = np.array(table.shape[:0:-1]) - 1.001
    at = np.clip(np.nan_to_num(at), 0.0, top)
    i, f = at.astype(int), at - np.floor(at)
    (u, v), (a, b) = i.T, f.T
    low = table[:, v, u] * (1 - a) + table[:, v, u + 1] * a
    high = table[:, v + 1, u] * (1 - a) + table[:, v + 1, u + 1] * a
    return np.asarray((low * (1 - b) + high * b).T)
