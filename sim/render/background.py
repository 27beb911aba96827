"""The empty scene as one camera sees it, traced and painted once for all frames of a sequence.

`PixelGeometry` is exact, for the ray through each pixel's centre. Colours are means over each pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.render.weather import Foliage, Illumination
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
    """What each pixel's centre shows of the empty scene."""

    depth: Floats  # (H, W) float32: m along the optical axis; inf for sky
    kind: NDArray[np.uint8]  # (H, W) uint8: NOTHING (sky), GROUND, WALL, PILLAR, TREAD or RISER of `sim.scene.raycast`
    place: Floats  # (H, W, 3) float32: x, y, z in m in the world; 1e9 for sky


@dataclass(frozen=True)
class EmptyScene:
    """The painted empty scene, float32; per pixel the mean of `picture.samples` rays each way, at least 2 at edges."""

    colour: Floats  # (H, W, 3) BGR in grey levels, 0 or more, not clipped at 255; lit, without plants' sway and noise
    # (H, W) share of direct sun in the pixel's light, 0 to 1; 0 for sky and where a solid thing hides the sun
    direct: Floats
    plants: Floats  # (H, W) share of the pixel that shows plants, 0 to 1


def trace_geometry(camera: Camera, scene: Scene) -> PixelGeometry:
    """Returns what the centre of each pixel shows of the empty scene."""
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
    samples: int = 1,
) -> EmptyScene:
    """Returns the empty scene under steady light, with unmoved plants.

    texture: contrast of the patterns, 0 to 1. samples: rays along each axis of a pixel. seed, repeat: name the random
    stream of colours, slabs and patterns.
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
        (rays.origin, rays.direction), samples, signed_scale(camera), light.sun, light.shadow, light.penumbra,
        solids_of(scene), np.array(scene.size, dtype=float), style, np.clip(palette, 20, 240), key,
        colour, direct, green,
    )  # fmt: skip
    return EmptyScene(colour, direct, green)
