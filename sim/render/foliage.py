"""Bushes and long grass: where on the ground they grow, and how far wind moves them at any moment.

Plants are flat: a part of the empty scene's image, with the ground's depth, which hides nobody. Only their image moves.
Wind is a field over the ground (`sim.render.random_fields`), so both cameras of a pair see the same sway. Gusts make
all sway stronger and weaker over time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.render.random_fields import PlaneWaves, oscillation, uniform_drift
from sim.rng import draw, rng
from sim.scene.raycast import pixel_rays, signed_scale, solids_of
from sim.types import Camera, Scene

if TYPE_CHECKING:
    from scenarios.schema.picture import Picture

SAMPLE_STEP = 4  # px between the samples that decide where plants grow
SWAY_LENGTH = 1.5  # m: correlation length of the sway
GUST, LULL = 0.5, 3.0  # standard deviation of the logarithm of the wind's strength, and its time constant in s
PLACE, ACROSS, DOWN, STRENGTH = range(4)  # keys of the random role "wind"


@dataclass(frozen=True, eq=False)
class Foliage:
    """The plants of a sequence, and the wind that moves them."""

    key: int  # key (whole number) of the random pattern `texture_kernels.plant_pattern`
    level: float  # plants grow where the pattern is above it, no unit
    # two random fields over ground and time: movement in px across and px down at a strength of 1
    sway: tuple[PlaneWaves, PlaneWaves]
    gusts: PlaneWaves  # field, the same everywhere: natural logarithm of the wind's strength, plus 0.25

    def strength(self, t: float) -> float:
        """Returns the wind's strength at time t (s), a factor on the sway; its mean square over time is 1."""
        return float(np.exp(self.gusts.at_origin(t) - GUST**2))


def grow_plants(picture: Picture, camera: Camera, scene: Scene, seed: int, repeat: int = 0) -> Foliage | None:
    """Returns the plants of this seed; None if their share is 0, or no ground in view is near enough."""
    source = rng(seed, "wind", PLACE, repeat=repeat)
    share = draw(picture.foliage, source)
    if not 0 <= share <= 1:
        raise InputError(
            place="picture.foliage", got=f"{share:g}", expected="a share, 0 to 1",
            remedy="correct it, or clip its distribution",
        )  # fmt: skip
    if share == 0:
        return None
    from sim.render.foliage_kernels import sample_plants

    key = int(source.integers(1 << 20))
    width, height = camera.image
    pattern, cover = np.empty((2, -(-height // SAMPLE_STEP), -(-width // SAMPLE_STEP)))
    rays, size = pixel_rays(camera), np.array(scene.size, dtype=float)
    scale = picture.samples * signed_scale(camera)  # leaves show farther away
    sample_plants((rays.origin, rays.direction), scale, SAMPLE_STEP, solids_of(scene), size, key, pattern, cover)
    # The level above which plants cover the wanted share of the image.
    order = np.argsort(-pattern, axis=None, kind="stable")
    covered = np.cumsum(cover.ravel()[order])
    if covered[-1] == 0:
        return None
    last = min(int(np.searchsorted(covered, share * cover.size)), int(np.isfinite(pattern).sum()) - 1)
    across, down = (
        oscillation(rng(seed, "wind", k, repeat=repeat), picture.sway_px, SWAY_LENGTH, picture.sway_time)
        for k in (ACROSS, DOWN)
    )
    gusts = uniform_drift(rng(seed, "wind", STRENGTH, repeat=repeat), GUST, LULL)
    return Foliage(key, float(pattern.ravel()[order[last]]), (across, down), gusts)
