"""Bushes and long grass: where on the ground they grow, and how far wind moves them at any moment.

They are flat: part of the plate, with its depth, hiding nobody. What moves is their picture. Wind is a field over the
ground (sim.render.random_fields), so both cameras of a pair see one sway, and gusts make all of it stronger and weaker.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.values import draw
from sim.render.random_fields import Waves, relaxing, swaying
from sim.rng import rng
from sim.scene.raycast import pixel_rays, signed_scale, solids_of
from sim.types import Camera, Scene

if TYPE_CHECKING:
    from scenarios.schema.picture import Picture

EVERY = 4  # px between the samples that decide where plants grow
TOGETHER = 1.5  # m over which plants sway alike
GUST, LULL = 0.5, 3.0  # sd of the logarithm of the wind's strength, and its time constant, s
PLACE, ACROSS, DOWN, STRENGTH = range(4)  # keys of the role "wind"


@dataclass(frozen=True, eq=False)
class Foliage:
    """key: of the pattern that says where plants grow; level: they do where it is higher; sway: px across and down."""

    key: int
    level: float
    sway: tuple[Waves, Waves]
    gusts: Waves

    def strength(self, t: float) -> float:
        """The wind's at time t, s; its mean square is 1."""
        return float(np.exp(self.gusts.at(t) - GUST**2))


def grow(picture: Picture, camera: Camera, scene: Scene, seed: int, repeat: int = 0) -> Foliage | None:
    """The plants of this seed, None without any; they cover the wanted share of this camera's image, as far as the
    ground that it sees near enough goes, preferably outside the world.

    InputError where the share drawn is not one.
    """
    source = rng(seed, "wind", PLACE, repeat=repeat)
    share = draw(picture.foliage, source)
    if not 0 <= share <= 1:
        raise InputError(
            place="picture.foliage", got=f"{share:g}", expected="a share, 0 to 1",
            remedy="correct it, or clip its distribution",
        )  # fmt: skip
    if share == 0:
        return None
    from sim.render.foliage_kernels import survey

    key = int(source.integers(1 << 20))
    width, height = camera.image
    pattern, near = np.empty((2, -(-height // EVERY), -(-width // EVERY)))
    rays, size = pixel_rays(camera), np.array(scene.size, dtype=float)
    survey((rays.origin, rays.direction), signed_scale(camera), EVERY, solids_of(scene), size, key, pattern, near)
    order = np.argsort(-pattern, axis=None, kind="stable")
    covered = np.cumsum(near.ravel()[order])
    if covered[-1] == 0:
        return None
    last = min(int(np.searchsorted(covered, share * near.size)), int(np.isfinite(pattern).sum()) - 1)
    across, down = (
        swaying(rng(seed, "wind", k, repeat=repeat), picture.sway_px, TOGETHER, picture.sway_time)
        for k in (ACROSS, DOWN)
    )
    gusts = relaxing(rng(seed, "wind", STRENGTH, repeat=repeat), GUST, LULL)
    return Foliage(key, float(pattern.ravel()[order[last]]), (across, down), gusts)
