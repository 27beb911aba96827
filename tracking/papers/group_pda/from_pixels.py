"""From a picture to the points of `group-pda`: foreground pixels on a grid, each a share of a person (ours)."""

from __future__ import annotations

import numpy as np

from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Camera, Context, Image
from tracking.detect.foreground import Foreground, convex_areas
from tracking.detect.person_size import PersonSize
from tracking.image_scale import required
from tracking.papers.group_pda.config import GroupPdaConfig

SLIM = 0.3
"""Width over height of a person seen from the side: where no camera tells."""
LEAST_STEEP = 0.2
"""A view nearly along the ground tells next to nothing of depth."""


class Pixels:
    """State: the foreground pipeline. scale: px per m, the context's or learned from lone blobs of its background
    sample; step: grid step, px; person (2,): width and height of a person in the image, px."""

    def __init__(self, config: GroupPdaConfig, context: Context) -> None:
        assert context.background is not None
        self.config = config
        self.foreground = Foreground(context, config, config.most_foreground)
        self.scale = required(_learned(self.foreground, context) if np.isnan(context.px_per_m) else context.px_per_m)
        self.foreground.px_per_m = self.scale
        self.step = max(1, round(config.grid * self.scale))
        self.person = _person(context.camera, self.scale)

    def follow(self, config: GroupPdaConfig) -> None:
        """Take on a config; background and scale stay as learned."""
        self.config = config
        self.foreground.follow(config, config.most_foreground)
        self.step = max(1, round(config.grid * self.scale))

    @property
    def share(self) -> float:
        """How much of a person a grid point is: cell / area of an ellipse of his size."""
        return float(self.step**2 / (np.pi / 4 * self.person.prod()))

    @property
    def spread(self) -> Array:
        """(2, 2) covariance of one person's pixels: a filled ellipse has a quarter of its semi-axes' squares."""
        return np.asarray(np.eye(2) * np.square(self.person / 4), np.float64)

    def points(self, image: Image, outlines: list[Array]) -> Array | None:
        """(M, 2) px centres of the grid's cells that are foreground; None where there is more than there can be.

        What lies in the groups' outlines (V, 2) stays out of the background, however long they stand.
        """
        seen = self.foreground.segment(image)
        self.foreground.adapt(seen, convex_areas(self.foreground.shape, outlines))
        return grid_points(seen.mask, self.step) if seen.plausible else None


def grid_points(mask: Bools, step: int) -> Array:
    """(M, 2) u, v of the foreground pixels in the middle of the cells of a grid."""
    first = step // 2
    v, u = np.nonzero(mask[first::step, first::step])
    return np.asarray(np.stack([u, v], 1) * float(step) + (first + 0.5), np.float64)


def steepness(camera: Camera | None) -> float:
    """Sine of the camera's tilt at the image's middle: how much of a length in depth shows; 1 without a camera."""
    return 1.0 if camera is None else float(max(-camera.rotation[2, 2], LEAST_STEEP))


def _learned(foreground: Foreground, context: Context) -> float:
    """px per m by the lone blobs of the background sample; nan where nobody was alone in it."""
    assert context.background is not None
    size = PersonSize(context)
    foreground.learn_person_size(size, context.background)
    return size.px_per_m


def _person(camera: Camera | None, scale: float) -> Array:
    if camera is None:
        return scale * PERSON_HEIGHT * np.array([SLIM, 1.0])
    from sim.scene.body import person_boxes
    from sim.scene.camera import to_ground

    middle = to_ground(camera, np.array([camera.image], float) / 2)
    turns = np.radians([0.0, 45.0, 90.0, 135.0])
    if not np.isfinite(middle).all():  # above the horizon
        return _person(None, scale)
    place = np.column_stack([np.repeat(middle, len(turns), 0), np.zeros(len(turns))])
    return np.asarray(person_boxes(camera, place, turns, np.full(len(turns), PERSON_HEIGHT))[:, 2:].mean(0))
