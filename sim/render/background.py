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
from sim.scene.terrain import flights
from sim.scene.visibility import unprojection
from sim.types import Array, Camera, Scene

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
class Rays:
    """Lines of sight: pixel (u, v) looks from origin @ (u, v, 1) along direction @ (u, v, 1), of depth 1 m per unit."""

    origin: Array
    direction: Array


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


def sight(camera: Camera) -> Rays:
    """Lines of sight of a camera as linear functions of the pixel."""
    origin, direction = np.zeros((3, 3)), np.zeros((3, 3))
    origin[:, 2] = camera.position
    if camera.kind == "pinhole":
        return Rays(origin, np.ascontiguousarray(unprojection(camera)))
    right, down, forward = camera.rotation
    origin[:, 0], origin[:, 1] = right / camera.px_per_m, down / camera.px_per_m
    origin[:, 2] -= origin[:, :2] @ np.array(camera.centre_px)
    direction[:, 2] = forward
    return Rays(origin, direction)


Solids = tuple[Array, float, Array, float, Array]


def solids(scene: Scene) -> Solids:
    """All that stands still, as the kernels want it: walls (W, 4), height, pillars (P, 3), height, flights (S, 9)."""
    walls = np.array(scene.walls, dtype=float).reshape(-1, 4)
    return (
        walls,
        float(scene.wall_height),
        np.array(scene.pillars, dtype=float),
        float(scene.pillar_height),
        flights(scene),
    )


def survey(camera: Camera, scene: Scene) -> Geometry:
    """What the middle of each pixel shows of the empty scene."""
    from sim.render.background_kernels import depths

    width, height = camera.image
    depth, place = np.empty((height, width), np.float32), np.empty((height, width, 3), np.float32)
    kind = np.empty((height, width), np.uint8)
    rays = sight(camera)
    depths(rays.origin, rays.direction, solids(scene), depth, kind, place)
    return Geometry(depth, kind, place)


def scale(camera: Camera) -> float:
    """px per m at a depth of 1 m; negative: px per m at any depth."""
    return float(camera.focal_px[0]) if camera.kind == "pinhole" else -camera.px_per_m


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
    rays = sight(camera)
    source = rng(seed, "texture", GROUND, repeat=repeat)
    palette = (
        PALETTE + SPREAD * source.normal(size=(len(PALETTE), 1)) + 0.3 * SPREAD * source.normal(size=(len(PALETTE), 3))
    )
    slab = float(source.choice([0.0, 0.5, 0.8, 1.2]))
    key = int(source.integers(1 << 20))
    look = np.array([texture, slab, *((plants.key, plants.level) if plants else (0.0, np.inf))])
    colours(
        (rays.origin, rays.direction), scale(camera), light.sun, light.shadow, light.penumbra, solids(scene),
        np.array(scene.size, dtype=float), look, np.clip(palette, 20, 240), key, colour, direct, green,
    )  # fmt: skip
    return Plate(colour, direct, green)
