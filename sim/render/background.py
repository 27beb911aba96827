"""The empty scene as one camera sees it, traced and painted once for all frames of a sequence.

`PixelGeometry` is exact, for the ray through each pixel's centre. Colours are means over each pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.render.foliage import Foliage
from sim.render.illumination import Illumination
from sim.rng import rng
from sim.scene.raycast import pixel_rays, signed_scale, solids_of
from sim.types import Camera, Scene

Floats = NDArray[np.float32]

# BGR at full light, rows GREY … SKY of the kernels: paving or asphalt, grass, wall, pillar, steps, sky.
PALETTE = np.array(
    [[150, 154, 155], [76, 128, 116], [150, 160, 170], [160, 164, 168], [162, 165, 167], [236, 230, 222]], float
)
SPREAD = 12.0  # grey levels: sd by which the brightness of a sequence's materials differs from the palette
SLAB_WIDTHS = (0.0, 0.5, 0.8, 1.2)  # m; 0 = asphalt
MATERIALS = 0  # key of the random role "texture"; people have the keys from 1 on


@dataclass(frozen=True)
class PixelGeometry:
    """What each pixel's centre shows of the empty scene.

    depth (H, W) m along the optical axis, inf for sky. kind (H, W): NOTHING … RISER of `sim.scene.raycast`. place
    (H, W, 3): world coordinates, m.
    """

    depth: Floats
    kind: NDArray[np.uint8]
    place: Floats


@dataclass(frozen=True)
class EmptyScene:
    """The painted empty scene.

    colour (H, W, 3) BGR: lit, in grey levels. direct (H, W): share of direct sun in the light of each pixel. plants
    (H, W): share of each pixel that shows plants.
    """

    colour: Floats
    direct: Floats
    plants: Floats


def trace_geometry(camera: Camera, scene: Scene) -> PixelGeometry:
    """Return what the centre of each pixel shows of the empty scene."""
    from sim.render.background_kernels import trace_pixels

    width, height = camera.image
    depth, place = np.empty((height, width), np.float32), np.empty((height, width, 3), np.float32)
    kind = np.empty((height, width), np.uint8)
    rays = pixel_rays(camera)
    trace_pixels(rays.origin, rays.direction, solids_of(scene), depth, kind, place)
    return PixelGeometry(depth, kind, place)


def paint_empty_scene(
    camera: Camera,
    scene: Scene,
    light: Illumination,
    texture: float,
    plants: Foliage | None,
    seed: int,
    repeat: int = 0,
) -> EmptyScene:
    """Return the colours of the empty scene under steady light, with unmoved plants.

    texture: contrast of the patterns, 0 to 1. seed, repeat: draw the materials.
    """
    from sim.render.background_kernels import paint_pixels

    width, height = camera.image
    colour, direct, green = np.empty((height, width, 3), np.float32), *np.empty((2, height, width), np.float32)
    rays = pixel_rays(camera)
    source = rng(seed, "texture", MATERIALS, repeat=repeat)
    palette = (
        PALETTE + SPREAD * source.normal(size=(len(PALETTE), 1)) + 0.3 * SPREAD * source.normal(size=(len(PALETTE), 3))
    )
    slab = float(source.choice(SLAB_WIDTHS))
    key = int(source.integers(1 << 20))
    # In the order of the slots CONTRAST, SLAB_WIDTH, PLANT_KEY, PLANT_LEVEL.
    style = np.array([texture, slab, *((plants.key, plants.level) if plants else (0.0, np.inf))])
    paint_pixels(
        (rays.origin, rays.direction), signed_scale(camera), light.sun, light.shadow, light.penumbra, solids_of(scene),
        np.array(scene.size, dtype=float), style, np.clip(palette, 20, 240), key, colour, direct, green,
    )  # fmt: skip
    return EmptyScene(colour, direct, green)
