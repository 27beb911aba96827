"""The plate: the empty scene as one camera sees it, made once for all frames of a sequence.

`Geometry` is exact, of the ray through each pixel's middle; colours are means over each pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sim.render.illumination import Illumination
from sim.rng import rng
from sim.scene.raycast import pixel_rays, signed_scale, solids_of
from sim.types import Camera, Scene

if TYPE_CHECKING:
    from sim.render.foliage import Foliage

Floats = NDArray[np.float32]

# BGR at full light: paving or asphalt, grass, wall, pillar, steps, sky.
PALETTE = np.array(
    [[150, 154, 155], [76, 128, 116], [150, 160, 170], [160, 164, 168], [162, 165, 167], [236, 230, 222]], float
)
SPREAD = 12.0  # grey levels by which a sequence's materials differ from the palette
GROUND = 0  # keys of the role "texture"; people have their own from 1 on


@dataclass(frozen=True)
class Geometry:
    """What each pixel's middle shows: depth (H, W) m, inf = sky; kind (H, W) of sim.scene.raycast_kernels; place (H,
    W, 3).
    """

    depth: Floats
    kind: NDArray[np.uint8]
    place: Floats


@dataclass(frozen=True)
class Plate:
    """Lit colours (H, W, 3) in grey levels; shares of each pixel (H, W): direct sun in its light, and plants."""

    colour: Floats
    direct: Floats
    plants: Floats


def survey(camera: Camera, scene: Scene) -> Geometry:
    """What the middle of each pixel shows of the empty scene."""
    from sim.render.background_kernels import depths

    width, height = camera.image
    depth, place = np.empty((height, width), np.float32), np.empty((height, width, 3), np.float32)
    kind = np.empty((height, width), np.uint8)
    rays = pixel_rays(camera)
    depths(rays.origin, rays.direction, solids_of(scene), depth, kind, place)
    return Geometry(depth, kind, place)


def paint_plate(
    camera: Camera,
    scene: Scene,
    light: Illumination,
    texture: float,
    plants: Foliage | None,
    seed: int,
    repeat: int = 0,
) -> Plate:
    """The empty scene's colours under steady light, nothing moving; materials are the seed's.

    texture: contrast of the patterns.
    """
    from sim.render.background_kernels import colours

    width, height = camera.image
    colour, direct, green = np.empty((height, width, 3), np.float32), *np.empty((2, height, width), np.float32)
    rays = pixel_rays(camera)
    source = rng(seed, "texture", GROUND, repeat=repeat)
    palette = (
        PALETTE + SPREAD * source.normal(size=(len(PALETTE), 1)) + 0.3 * SPREAD * source.normal(size=(len(PALETTE), 3))
    )
    slab = float(source.choice([0.0, 0.5, 0.8, 1.2]))
    key = int(source.integers(1 << 20))
    look = np.array([texture, slab, *((plants.key, plants.level) if plants else (0.0, np.inf))])
    colours(
        (rays.origin, rays.direction), signed_scale(camera), light.sun, light.shadow, light.penumbra, solids_of(scene),
        np.array(scene.size, dtype=float), look, np.clip(palette, 20, 240), key, colour, direct, green,
    )  # fmt: skip
    return Plate(colour, direct, green)
