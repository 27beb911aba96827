"""From a picture to the points of `group-pda`: foreground pixels on a grid, each a share of a person (ours).

The foreground comes from tracking.detect.foreground.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Camera, Context, Image
from tracking.detect.foreground import Foreground, convex_areas
from tracking.detect.person_size import PersonSize
from tracking.image_scale import required
from tracking.papers.group_pda.config import GroupPdaConfig

WIDTH_PER_HEIGHT = 0.3
"""Width over height of a person in the image if there is no camera."""
LEAST_SINE_TILT = 0.2
"""Lower bound of `sine_tilt`: in a view along the ground depth cannot be measured."""


class ForegroundPoints:
    """State: the foreground pipeline with its background model.

    scale: px per metre, the context's or learned from lone people in its background sample. step: px between the grid's
    points. person (2,): width and height of a person in the image, px.
    Raises InputError if the scale is neither known nor learned.
    """

    def __init__(self, config: GroupPdaConfig, context: Context) -> None:
        assert context.background is not None
        self.config = config
        self.foreground = Foreground(context, config, config.most_foreground)
        self.scale = required(_learned(self.foreground, context) if np.isnan(context.px_per_m) else context.px_per_m)
        self.foreground.px_per_m = self.scale
        self.step = max(1, round(config.grid * self.scale))
        self.person = _person(context.camera, self.scale)

    def follow(self, config: GroupPdaConfig) -> None:
        """Use another config from now on. The background model and the scale stay as they are."""
        self.config = config
        self.foreground.follow(config, config.most_foreground)
        self.step = max(1, round(config.grid * self.scale))

    @property
    def people_per_point(self) -> float:
        """The people that one grid point stands for: the area of a grid cell over that of a person's ellipse."""
        return float(self.step**2 / (np.pi / 4 * self.person.prod()))

    @property
    def body_cov(self) -> Array:
        """Covariance (2, 2), px^2, of one person's pixels: those of a filled ellipse, its semi-axes squared over 4."""
        return np.asarray(np.eye(2) * np.square(self.person / 4), np.float64)

    def points(self, image: Image, outlines: list[Array]) -> Array | None:
        """Return the grid points (M, 2) in px that are foreground; None if more is foreground than `most_foreground`.

        outlines: points (V, 2) in px round each group. The background model learns from the picture except inside their
        convex hulls, so that people who stand still do not become background.
        """
        seen = self.foreground.segment(image)
        self.foreground.adapt(seen, convex_areas(self.foreground.shape, outlines))
        return grid_points(seen.mask, self.step) if seen.plausible else None


def grid_points(mask: Bools, step: int) -> Array:
    """Return u, v (M, 2) in px of the centres of the foreground pixels on a grid of every `step`-th pixel.

    mask (H, W): True for foreground.
    """
    first = step // 2
    v, u = np.nonzero(mask[first::step, first::step])
    return np.asarray(np.stack([u, v], 1) * float(step) + (first + 0.5), np.float64)


def sine_tilt(camera: Camera | None) -> float:
    """Return the sine of the camera's tilt, by which depth is shortened: at least 0.2; 1 without a camera."""
    return 1.0 if camera is None else float(max(-camera.rotation[2, 2], LEAST_SINE_TILT))


def _learned(foreground: Foreground, context: Context) -> float:
    """The scale, px per m, by people who are alone in the background sample; nan if there are none."""
    assert context.background is not None
    size = PersonSize(context)
    foreground.learn_person_size(size, context.background)
    return size.px_per_m


def _person(camera: Camera | None, scale: float) -> Array:
    """Width and height (2,) in px of a person: the mean box at the image's centre over directions, or by the scale.

    The scale, px per m, is used without a camera and if the image's centre is above the horizon.
    """
    if camera is None:
        return scale * PERSON_HEIGHT * np.array([WIDTH_PER_HEIGHT, 1.0])
    from sim.scene.body import person_boxes
    from sim.scene.camera import to_ground

    middle = to_ground(camera, np.array([camera.image], float) / 2)
    turns = np.radians([0.0, 45.0, 90.0, 135.0])
    if not np.isfinite(middle).all():
        return _person(None, scale)
    place = np.column_stack([np.repeat(middle, len(turns), 0), np.zeros(len(turns))])
    return np.asarray(person_boxes(camera, place, turns, np.full(len(turns), PERSON_HEIGHT))[:, 2:].mean(0))
