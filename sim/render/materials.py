"""Materials of one sequence's empty scene: palette, pattern of the ground, walls, backdrop, fog and lamps.

All is drawn from streams of the sequence's looks. A kind of ground is a row of numbers: the kernels know slabs, joints
and grain, not kinds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sim.rng import rng
from sim.types import Array, Camera, Motion

if TYPE_CHECKING:
    from scenarios.schema.pictures import Light, Picture
    from sim.render.weather import Foliage

MATERIALS, KIND, LAMPS = 0, 1, 2  # keys of the random role "texture": (0,), (0, 1), (0, 2); people have (1,), (2,), …

GREY, GRASS, BRICK, STONE, STEP, SKY = range(6)  # rows of the palette
# BGR at full light: paving or asphalt, grass, wall, pillar, steps, sky.
PALETTE = np.array(
    [[150, 154, 155], [76, 128, 116], [150, 160, 170], [160, 164, 168], [162, 165, 167], [236, 230, 222]], float
)
SPREAD = 12.0  # grey levels: sd by which the brightness of a sequence's materials differs from the palette
SLAB_WIDTHS = (0.0, 0.5, 0.8, 1.2)  # m; 0 = asphalt


class GroundKind(NamedTuple):
    """One kind of ground; of each range a sequence draws one value."""

    colour: tuple[float, float, float]  # BGR at full light
    width: tuple[float, float]  # m, of slabs; 0: no slabs
    shape: float  # depth of a slab over its width
    tile: float  # contrast between slabs
    grain: float  # contrast of the grain
    gloss: float  # share of the ground that mirrors the sky, as if wet
    coarsest: float = 0.12  # m: longest wavelength of the grain
    mottle: float = 0.5  # factor of the contrast of patches


GROUNDS = {
    "paving": GroundKind((140, 148, 156), (0.2, 0.7), 0.6, 0.2, 0.22, 0.0),
    "tiles": GroundKind((150, 160, 172), (0.25, 0.6), 1.0, 0.3, 0.1, 0.05),
    "asphalt": GroundKind((134, 134, 134), (0.0, 0.0), 1.0, 0.0, 0.22, 0.0),
    "concrete": GroundKind((158, 164, 166), (2.0, 4.0), 1.0, 0.07, 0.14, 0.0),
    "gravel": GroundKind((118, 142, 156), (0.0, 0.0), 1.0, 0.0, 0.4, 0.0),
    "grass": GroundKind((64, 112, 96), (0.0, 0.0), 1.0, 0.0, 0.45, 0.0),
    "floor": GroundKind((168, 176, 182), (0.6, 1.2), 1.0, 0.06, 0.04, 0.35),
}
ANY = GroundKind((150, 154, 155), (0.0, 0.0), 0.6, 0.16, 0.26, 0.0, 0.4, 1.0)
VERGES = (1.0, 4.0, 12.0, np.inf)  # m beyond the world at which grass begins
ROADS = (2.0, 3.0, 4.5, np.inf, np.inf)  # m: half the width of a road through the middle of the world; inf: no road
RAGGED = (0.03, 0.12, 0.12)  # m: raggedness of the border of a road or square, the first with kerbs; 0.3 for any ground
# BGR of walls and houses that are not of the plain brick: red brick, cream, grey, ochre, white, dark
FACADES = ((72, 92, 150), (170, 200, 220), (140, 142, 145), (100, 150, 190), (212, 218, 220), (85, 88, 95))
WALLS = ("brick", "plaster", "panels", "windows")
BACKDROPS = ("none", "hedge", "woods", "houses")
BACKDROP_GAP = 3.0  # m between the farthest person and the backdrop
NEAREST_BACKDROP = 12.0  # m from the camera
LAMP_HEIGHTS = (4.0, 8.0)  # m


class Style(NamedTuple):
    """What the kernels need to paint surfaces, beside the palette."""

    key: int  # of the random patterns
    contrast: float  # of all patterns
    slab_width: float  # m; 0: none
    slab_shape: float  # depth of a slab over its width
    tile: float  # contrast between slabs
    grain: float  # contrast of the ground's grain
    coarsest: float  # m: longest wavelength of that grain
    mottle: float  # factor of the contrast of patches, 1 in grounds of any kind
    verge: float  # m beyond the world at which grass begins
    ragged: float  # m: amplitude of its border
    road: Array  # (3,) cosine and sine of a road's direction, and half its width, m; inf: no road
    paint: float  # contrast of painted lines
    stains: float  # contrast of stains
    wet: float  # share of the ground that is wet or glossy
    plant_key: int  # key of the plants' pattern
    plant_level: float  # plants grow where it is higher; inf: nowhere
    walls: int  # index in WALLS
    backdrop: int  # index in BACKDROPS
    far: Array  # (3,) x, y of the left camera, and half the side of the square round it that is the backdrop, m
    fog: float  # 1/m
    lamps: Array  # (L, 3) x, y and height, m
    lamp_share: float  # of the light below a lamp


def draw_materials(
    picture: Picture, light: Light, plants: Foliage | None, motion: Motion, camera: Camera, look: tuple[int, int]
) -> tuple[Array, Style]:
    """Returns the palette (6, 3), rows GREY …, BGR, and the Style. camera: the left one. look: look seed and repeat."""
    seed, repeat = look
    source = rng(seed, "texture", MATERIALS, repeat=repeat)
    spread = picture.variety * SPREAD
    shades = source.normal(size=(len(PALETTE), 1)), 0.3 * spread * source.normal(size=(len(PALETTE), 3))
    slab, base = float(source.choice(SLAB_WIDTHS)), PALETTE
    key = int(source.integers(1 << 20))
    kind, base, verge, ragged, road = ANY, PALETTE.copy(), 1.0, 0.3, np.array([1.0, 0.0, np.inf])
    own = rng(seed, "texture", MATERIALS, KIND, repeat=repeat)
    if picture.ground != "any":
        kind, ragged = GROUNDS[picture.ground], float(own.choice(RAGGED))
        slab, verge, turn = own.uniform(*kind.width), float(own.choice(VERGES)), own.uniform(-0.5, 0.5)
        road = np.array([np.cos(turn), np.sin(turn), own.choice(ROADS)])
        base[GREY] = kind.colour
    if not picture.grass:
        road[2] = np.inf
    if not picture.grass or road[2] < np.inf:
        verge = np.inf
    if picture.walls != "brick" or picture.backdrop == "houses":
        base[BRICK] = FACADES[int(own.integers(len(FACADES)))]
    place = rng(seed, "texture", MATERIALS, LAMPS, repeat=repeat)
    size = np.array(motion.scene.size, dtype=float)
    lamps = place.uniform([0.0, 0.0, LAMP_HEIGHTS[0]], [*size, LAMP_HEIGHTS[1]], (light.lamps, 3))
    style = Style(
        key, picture.texture, slab, kind.shape, kind.tile, kind.grain, kind.coarsest, kind.mottle, verge, ragged, road,
        picture.paint, picture.stains, max(light.wet, kind.gloss),
        *((plants.key, plants.level) if plants else (0, np.inf)), WALLS.index(picture.walls),
        BACKDROPS.index(picture.backdrop), _far(motion, camera, own.uniform()),
        0.0 if camera.kind == "top" else light.fog, lamps, light.lamp_share,
    )  # fmt: skip
    return np.clip(base + spread * shades[0] + shades[1], 20, 240), style


def _far(motion: Motion, camera: Camera, share: float) -> Array:
    """Returns `Style.far`: beyond all people, at most twice as far."""
    middle = camera.position[:2]
    if camera.kind == "top":
        return np.array([*middle, np.inf])
    distance = np.linalg.norm(motion.pos - middle, axis=2)
    farthest = float(np.nanmax(distance, initial=0.0)) + BACKDROP_GAP
    return np.array([*middle, (1 + share) * max(farthest, NEAREST_BACKDROP)])
