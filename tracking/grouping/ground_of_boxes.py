"""The ground under people who are tracked in the image of an unknown camera, from their boxes (ours).

A pinhole camera without roll stands at the height C above flat ground and looks down by the tilt t; its focal length
is assumed. A foot at image row v is seen at the slope s = (v - centre) / focal + tan t below the horizon. A person of
height H who stands there has a box of height h. With r = 1 - h / (focal s), the box says

    H / C = (1 - r) / (1 - r s sin t cos t)                                                                         (1)

so that each tilt gives one value for each box. The tilt is the one on which the boxes agree best: with the least mean
absolute deviation of ln (H / C) from its median. Lone deviations are bounded, as boxes are cut and people sit. Where
the boxes do not agree much better than on one height in px (equal boxes, all people at one row, stairs, a moving
camera), the ground is unknown.

The first boxes decide, so that later frames change nothing. The focal length hardly matters for who is together: scores
of groups are the same from 0.8 to 1.1 of the width of the picture, and a little lower at 1.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.scene.camera import camera_rotation
from sim.types import Array, Camera, Tracks

BOXES, LEAST = 300, 100  # boxes that the first frames hold together, and least number
LONGEST = 60.0  # s from the first box on, after which later boxes do not count, even if there are fewer
TILTS = np.radians(np.arange(-10.0, 71.0))
FOCAL = 1.1  # focal length over the width of the picture: between wide lenses (0.8) and surveillance (1.5)
FARTHEST = 0.5  # largest deviation of ln (H / C) that counts, and that of boxes that cannot stand on the ground
SURE = 2 / 3  # the mean deviation must be below that of ln h times this


@dataclass(frozen=True)
class Ground:
    """The camera above the ground, None if the ground is unknown, and the last frame whose boxes were used. The frame
    is 0 if no boxes were used: the camera is then that of the sequence."""

    camera: Camera | None = None
    frames: int = 0

    @property
    def source(self) -> str | None:
        """What the ground is known from: "boxes", "camera", or None if it is unknown."""
        return None if self.camera is None else "boxes" if self.frames else "camera"


def ground_of_boxes(tracks: Sequence[Tracks], px_per_m: float, image_size: tuple[int, int] | None = None) -> Ground:
    """Returns the ground that follows from the first 300 measured boxes (some more, to end a frame), or unknown.

    px_per_m: image scale at the median height h of these boxes, so that a person's height is H = h / px_per_m.
    image_size: width, height, px; None takes the right and bottom ends of the boxes."""
    box, last, begun = np.zeros((0, 4)), 0, np.inf
    for t in tracks:
        if len(box) >= BOXES or t.t > begun + LONGEST:
            break
        measured = t.measured & (t.box[:, 3] > 0) if t.box is not None else np.zeros(0, bool)
        if t.box is not None and measured.any():
            box, last, begun = np.concatenate([box, t.box[measured]]), t.index, min(begun, t.t)
    fit = fit_ground(box, px_per_m, image_size) if len(box) >= LEAST else None
    return Ground(fit.camera if fit is not None and fit.agrees else None, last)


@dataclass(frozen=True)
class GroundFit:
    """The camera on whose ground boxes agree best. Mean absolute deviations, bounded: `spread` of ln (H / C) from its
    median there, `alone` of ln h."""

    camera: Camera
    spread: float
    alone: float

    @property
    def agrees(self) -> bool:
        """Whether boxes agree on the ground so much better than on one height in px that it is used."""
        return self.spread < SURE * self.alone


def fit_ground(box: Array, px_per_m: float, image_size: tuple[int, int] | None = None) -> GroundFit | None:
    """Returns the ground of boxes (R, 4), px, of people; None if they tell none. Other arguments as above."""
    width, height = image_size or (box[:, :2] + box[:, 2:]).max(axis=0).tolist()
    if width <= 0 or not px_per_m > 0:
        return None
    size, focal = box[:, 3], FOCAL * width
    log_ratio = _log_ratios((box[:, 1] + size - height / 2) / focal, size / focal)
    seen = np.isfinite(log_ratio).any(axis=1)
    middle = np.zeros(len(TILTS))
    middle[seen] = np.nanmedian(log_ratio[seen], axis=1)
    spread = _spread(log_ratio - middle[:, None])
    best = int(spread.argmin())
    position = np.array([0.0, 0.0, np.median(size) / px_per_m / np.exp(middle[best])])
    picture, rotation = (int(np.ceil(width)), int(np.ceil(height))), camera_rotation(TILTS[best], 0.0)
    camera = Camera("pinhole", picture, (focal, focal), (width / 2, height / 2), position, rotation)
    return GroundFit(camera, float(spread[best]), float(_spread(np.log(size / np.median(size)))))


def _log_ratios(foot: Array, size: Array) -> Array:
    """Returns ln (H / C) of eq. 1 by tilt and box, nan above the horizon; foot, size (R,): over the focal length."""
    down = foot + np.tan(TILTS)[:, None]
    stands = down > 0
    r = 1 - size / np.where(stands, down, np.nan)
    with np.errstate(divide="ignore"):  # a box that ends at the point right below the camera
        ratio = (1 - r) / (1 - r * down * (np.sin(TILTS) * np.cos(TILTS))[:, None])
    return np.log(np.where(ratio > 0, ratio, np.nan))


def _spread(deviation: Array) -> Array:
    return np.asarray(np.nan_to_num(np.minimum(np.abs(deviation), FARTHEST), nan=FARTHEST).mean(axis=-1))
