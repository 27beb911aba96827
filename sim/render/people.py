"""People and things of a motion as the compiled drawing takes them, each of K ellipsoids, and how they are coloured.

For a camera it computes: its rays in the axes of each ellipsoid, the outlines in the image (ellipses in px), nearest
depths in m, and the range of rows and columns of the pixels that each person can cover. Clothes are colours and
patterns, painted on texture pages (uint8, BGR), such as one for the body and one for the head; each person draws from
random streams of their own, so one person more changes nobody else's clothes. In the light of the sun it computes where
each person's shadow falls in the image (outlines, ranges of pixels, softness of the edge), and whether solid things
such as walls hide the sun from feet, waist and head.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim.render.camera_view import OCCLUDER
from sim.rng import rng
from sim.scene.body import BODY, Ellipsoids, Outlines, RecordedBodies, outlines, packed_inverse, parts_of_people
from sim.scene.camera import project
from sim.scene.figure import SHAPES, THINGS, TOPS, Parts
from sim.scene.figure import things as shapes_of_things
from sim.scene.raycast import HIT_SLOTS, PixelRays, Solids
from sim.types import Array, Camera, Ints, Looks, Motion

if TYPE_CHECKING:
    from sim.render.weather import Illumination

# Palettes in BGR, grey levels.
SKINS = np.array([[120, 150, 195], [105, 135, 180], [80, 110, 150], [55, 75, 105]], float)
HAIRS = np.array([[30, 32, 36], [35, 45, 60], [60, 85, 110], [120, 125, 128]], float)
TROUSERS = np.array([[42, 35, 33], [98, 70, 50], [66, 68, 70], [84, 106, 126], [28, 26, 26], [36, 32, 32]], float)
SHIRTS = np.array(
    [[28, 28, 30], [30, 26, 26], [52, 42, 38], [96, 60, 38], [50, 45, 135], [72, 100, 68], [205, 206, 208],
     [160, 150, 128], [90, 165, 205], [92, 92, 96], [36, 52, 78]], float,
)  # fmt: skip
SHOES = np.array([35.0, 36.0, 38.0])
GOODS = np.array(
    [[30, 30, 32], [70, 45, 32], [48, 44, 140], [60, 110, 70], [150, 152, 155], [200, 200, 202], [45, 80, 120],
     [120, 80, 40], [50, 150, 190]], float,
)  # fmt: skip
DARK_GOODS = np.array([[36.0, 36.0, 37.0]])  # tyres, handles
GOODS_COLOURS, THING_COLOURS = 2, 3  # keys of the random role "looks"; sim.looks has 1 and 4
COLOURS_OF_THING = 3  # pages MAIN, SECOND, DARK
SLEEVE_ENDS = (-0.2, 0.0, 0.0, 0.45)  # height on the body where sleeves end: at the hand, or above the elbow
LEVEL_SD, TINT_SD = 0.28, 0.06  # sd of the logarithm of a garment's brightness, and of each colour, against the palette
CUT_SHARES = (0.45, 0.06, 0.05, 0.1, 0.24, 0.1)  # of the cuts PLAIN … DRESS in sim.render.people_kernels


WHOLE = (0.0, 1.0)  # part of the body's height that a page shows: middle and half extent, in the body's half axes


def _share(low: float, high: float) -> tuple[float, float]:
    """Returns the place on the body of the plain figure, as WHOLE, of a part from `low` to `high`, shares of height."""
    return (low + high) / (2 * BODY.up) - 1, (high - low) / (2 * BODY.up)


def _pages(looks: Looks | None) -> tuple[list[tuple[int, float, float]], list[int]]:
    """Returns the kind and place of each page of a person, and which of them each of the person's parts has."""
    from sim.render.people_kernels import ARM_PAGE, BODY_PAGE, CARRIED, HEAD_PAGE, PLAIN_PAGE, SHIRT, SKIN
    from sim.render.people_kernels import SHOES as SHOE

    pages = [(BODY_PAGE, *WHOLE), (HEAD_PAGE, *WHOLE)]
    order = [0, 1]
    if looks is not None and looks.limbs:
        pages = [
            (BODY_PAGE, *_share(0.50, 0.86)), (HEAD_PAGE, *WHOLE), (BODY_PAGE, *_share(0.745, 0.845)),
            (BODY_PAGE, *_share(0.43, 0.61)), (PLAIN_PAGE + SKIN, *WHOLE), (BODY_PAGE, *_share(0.24, 0.54)),
            (BODY_PAGE, *_share(0.045, 0.31)), (PLAIN_PAGE + SHOE, *WHOLE), (ARM_PAGE, *_share(0.60, 0.81)),
            (ARM_PAGE, *_share(0.40, 0.65)),
        ]  # fmt: skip
        order = [*range(5), *np.repeat(range(5, 10), 2).tolist()]
    if looks is not None and looks.worn.size:
        order += (len(pages) + np.array([0, 1, 1, 2])).tolist()
        pages += [(PLAIN_PAGE + row, *WHOLE) for row in (SHIRT, CARRIED, CARRIED + 1)]
    return pages, order


def clothing_atlas(
    people: int, seed: int, repeat: int = 0, clothes: Array | None = None, looks: Looks | None = None
) -> NDArray[np.uint8]:
    """Returns the texture pages (Q, texels) uint8 of people 1 … P, and then of the things of `looks`, MAIN … DARK each.

    clothes, looks: as of a Motion. Without looks each person has a page for the body and one for the head.

    A page has UP rows from the ground upwards, ROUND + 1 columns round the body (the first repeated), and B, G, R.
    """
    from sim.render.people_kernels import PLAIN_PAGE, ROUND, SECOND, SHIRT, UP, draw_page
    from sim.render.people_kernels import TROUSERS as LEGS

    limbs = looks is not None and looks.limbs
    wanted, drawn = _pages(looks)[0], np.empty((UP, ROUND, 3))
    things = 0 if looks is None else len(looks.kind)
    pages = np.empty((people * len(wanted) + COLOURS_OF_THING * things, UP, ROUND + 1, 3), np.uint8)

    def paint(at: int, kind: int, middle: float, extent: float, style: Array, key: int, colours: Array) -> None:
        draw_page(style, key, colours, kind, middle, extent, drawn)
        pages[at, :, :ROUND] = np.clip(drawn + 0.5, 0, 255)

    for k in range(people):
        source = rng(seed, "texture", k + 1, repeat=repeat)
        key = int(source.integers(1 << 20))
        cut, count = source.choice(len(CUT_SHARES), p=CUT_SHARES), source.integers(2, 5)
        # In the order of the slots CUT, COUNT, HEM, HAIRLINE, LEG_GAP, ARM, SLEEVE.
        style = np.array([cut, count, *source.uniform([-0.05, -0.3, 0.5, 0.62], [0.2, 0.35, 0.8, 0.8]), 0.0])
        first, second = source.choice(len(SHIRTS), 2, replace=False)
        chosen = [
            SHOES, TROUSERS[source.integers(len(TROUSERS))], SHIRTS[first], SHIRTS[second],
            SKINS[source.integers(len(SKINS))], HAIRS[source.integers(len(HAIRS))],
        ]  # fmt: skip
        level = np.exp(LEVEL_SD * source.normal(size=(6, 1))) * np.exp(TINT_SD * source.normal(size=(6, 3)))
        colours = np.clip(np.array(chosen) * level, 12, 240)
        for rows, given in zip(([SHIRT, SECOND], [LEGS]), () if clothes is None else clothes[k], strict=False):
            if np.isfinite(given).all():
                colours[rows] = given[::-1]
        if looks is not None:
            extra = rng(seed, "looks", GOODS_COLOURS, k + 1, repeat=repeat)
            colours = np.concatenate([colours, _goods(extra, GOODS)])
            if limbs:
                # Limbs are drawn as such, not painted on the body.
                style[4:] = 0.0, 2.0, extra.choice(SLEEVE_ENDS)
        for n, page in enumerate(wanted):
            paint(k * len(wanted) + n, *page, style, key, colours)
    for m in range(things):
        assert looks is not None
        kind, number, first_page = int(looks.kind[m]), int(looks.number[m]), people * len(wanted) + COLOURS_OF_THING * m
        source = rng(seed, "looks", THING_COLOURS, kind, number, repeat=repeat)
        colours = np.concatenate([_goods(source, HAIRS if THINGS[kind] == "dog" else GOODS), DARK_GOODS])
        for n in range(COLOURS_OF_THING):
            paint(first_page + n, PLAIN_PAGE + n, *WHOLE, np.zeros(7), number, colours)
    pages[:, :, ROUND] = pages[:, :, 0]
    return pages.reshape(len(pages), UP * (ROUND + 1) * 3)


def _goods(source: np.random.Generator, palette: Array) -> Array:
    """Returns two colours (2, 3), B, G, R, near those of a palette (C, 3)."""
    level = np.exp(LEVEL_SD * source.normal(size=(2, 1))) * np.exp(TINT_SD * source.normal(size=(2, 3)))
    return np.asarray(np.clip(palette[source.integers(len(palette), size=2)] * level, 12, 240))


class ImageOutlines(NamedTuple):
    """Ellipses of N people or things in the image, K each; the second axis is that of Ellipsoids."""

    middle: Array  # (N, K, 2) centres, u and v in px; nan if not wholly in front of the camera
    inverse: Array  # (N, K, 3) inverse shapes in 1/px²: matrix entries 11, 12, 22; nan likewise
    # (N, 4) first row, last row + 1, first column, last column + 1 of the pixels that any ellipse may cover, clipped
    # to the image; no rows or no columns if an ellipse is nan or outside
    bounds: Ints


class PeopleInView(NamedTuple):
    """N people, or things, of one or more frames as a camera sees them; the axis of length K is that of Ellipsoids."""

    id: Ints  # (N,) person id = column of the Motion (from 0) + 1; OCCLUDER for things
    page: Ints  # (N, K) row of the atlas
    centre: Array  # (N, K, 3) m: of the ellipsoids, in the world
    half: Array  # (N, K, 3) half axes in m: across (to the right), along the heading, up; these are the own axes
    sun: Array  # (N, K, 3) unit vector to the sun, in own axes
    # (N, K, 3) share of the sun that reaches the lower end, middle and upper end of a part (columns); 0 if a solid
    # thing, as a wall, hides it
    sunlit: Array
    # (N, K, 3, 3) times (u, v, 1): origin of a pixel's ray in the part's axes, where it is a ball of radius 1
    start: Array
    step: Array  # (N, K, 3, 3) times (u, v, 1): direction of that ray, depth 1 m per unit
    nearest: Array  # (N, K) m along the optical axis: no point of the part is nearer; negative behind the camera
    outlines: ImageOutlines


def people_in_view(
    motion: Motion, people: RecordedBodies, camera: Camera, rays: PixelRays, solids: Solids, sun: Array
) -> PeopleInView:
    """Returns N people as a camera sees them. rays: those of the camera. sun (3,): unit vector to the sun."""
    t, p, looks = people.frame - 1, people.id - 1, motion.looks
    parts = parts_of_people(motion, t, p)
    pages, order = _pages(looks)
    page = len(pages) * p[:, None] + np.array(order)
    lit = sunlit_shares(solids, people.pos3, motion.height[p], sun)
    if looks is None:
        lit = np.stack([lit, np.repeat(lit[:, 2:], 3, axis=1)], axis=1)
    else:
        lit = _sunlit_parts(lit, parts, motion.height[p])
    return _in_view(people.id, page, people, motion.heading[t, p], parts, lit, camera, rays, sun)


def things_in_view(
    motion: Motion, things: RecordedBodies, camera: Camera, rays: PixelRays, solids: Solids, sun: Array
) -> PeopleInView:
    """Returns N things as a camera sees them, as `people_in_view` does people."""
    t, m, looks = things.frame - 1, things.id - 1, motion.looks
    assert looks is not None
    first = len(_pages(looks)[0]) * motion.present.shape[1]
    kind, tall = looks.kind[m], looks.size[m] * TOPS[looks.kind[m]]
    parts = shapes_of_things(kind, looks.size[m], looks.step[t, m])
    page = first + COLOURS_OF_THING * m[:, None] + SHAPES[kind][..., -1].astype(np.int64)
    lit = _sunlit_parts(sunlit_shares(solids, things.pos3, tall, sun), parts, tall)
    id = np.full(len(m), OCCLUDER)
    return _in_view(id, page, things, looks.turn[t, m], parts, lit, camera, rays, sun)


def _in_view(
    id: Ints, page: Ints, people: RecordedBodies, heading: Array, parts: Parts, lit: Array, camera: Camera,
    rays: PixelRays, sun: Array,
) -> PeopleInView:  # fmt: skip
    centre = people.shapes.centre
    c, s = np.cos(heading), np.sin(heading)
    turn = np.zeros((*parts.pitch.shape, 3, 3))  # from the world to a part's own axes
    turn[..., 0, 0], turn[..., 0, 1] = s[:, None], -c[:, None]
    swung, still = np.sin(parts.pitch), np.cos(parts.pitch)
    turn[..., 1, 0], turn[..., 1, 1], turn[..., 1, 2] = c[:, None] * still, s[:, None] * still, swung
    turn[..., 2, 0], turn[..., 2, 1], turn[..., 2, 2] = -c[:, None] * swung, -s[:, None] * swung, still
    to_ball = turn / parts.half[..., None]
    start = to_ball @ rays.origin
    start[..., 2] -= np.einsum("npij,npj->npi", to_ball, centre)
    forward = camera.rotation[2]
    depth = (centre - camera.position) @ forward
    nearest = depth - np.sqrt(np.einsum("i,npij,j->np", forward, people.shapes.shape, forward))
    seen = image_outlines(camera, outlines(camera, people.shapes))
    step = to_ball @ rays.direction
    return PeopleInView(id, page, centre, parts.half, turn @ sun, lit, start, step, nearest, seen)


def _sunlit_parts(lit: Array, parts: Parts, height: Array) -> Array:
    """Returns `sunlit` (N, K, 3) of the parts of shapes of a height (N,) m. lit (N, 3): at LIT_HEIGHTS."""
    feet, waist, head = LIT_HEIGHTS
    rise = np.abs(np.cos(parts.pitch)) * parts.half[..., 2]
    at = (parts.offset[..., 2, None] + rise[..., None] * np.array([-1.0, 0.0, 1.0])) / height[:, None, None]
    low, high = np.clip((at - feet) / (waist - feet), 0, 1), np.clip((at - waist) / (head - waist), 0, 1)
    by = lit[:, None, None]
    return np.asarray(by[..., 0] + (by[..., 1] - by[..., 0]) * low + (by[..., 2] - by[..., 1]) * high)


def image_outlines(camera: Camera, ellipses: Outlines) -> ImageOutlines:
    """Returns N people's ellipses in the image, each with the pixel bounds of all its parts together."""
    half = np.sqrt(np.diagonal(ellipses.shape, axis1=2, axis2=3))
    bounds = pixel_bounds(camera, (ellipses.centre - half).min(axis=1), (ellipses.centre + half).max(axis=1))
    return ImageOutlines(ellipses.centre, packed_inverse(ellipses.shape), bounds)


def pixel_bounds(camera: Camera, low: Array, high: Array) -> Ints:
    """Returns the bounds (N, 4) of the pixels inside the image that N boxes touch; no pixel for a nan box.

    Columns: first row, last row + 1, first column, last column + 1. low, high (N, 2): corners u, v of the boxes, px.
    """
    size = np.array(camera.image, dtype=float)
    low, high = (np.clip(np.nan_to_num(edge), 0, size) for edge in (low, high))
    edges = np.stack([np.floor(low[:, 1]), np.ceil(high[:, 1]), np.floor(low[:, 0]), np.ceil(high[:, 0])], axis=1)
    return edges.astype(np.int64)


LIT_HEIGHTS = (0.12, 0.5, 0.95)  # of the height: feet (they stand a step deep in drawn stairs), waist, head


class PeopleShadows(NamedTuple):
    """Shadows of N people or things on the ground at their feet; the second axis is that of Ellipsoids."""

    shape: Array  # (N, K, 3) inverse of each shadow ellipse's 2 x 2 shape matrix, 1/m²: entries 11, 12, 22, in x and y
    softness: Array  # (N, K) half the penumbra's width over the geometric mean of the ellipse's half axes, no unit
    # ImageOutlines of the shadows with their soft edges, and of the pixels on which they can fall
    outlines: ImageOutlines


def people_shadows(
    height: Array, people: RecordedBodies, camera: Camera, light: Illumination, level: bool
) -> PeopleShadows:
    """Returns the shadows of N people or things of a height (N,) m as a camera sees them.

    An ellipsoid with centre c and shape S casts on the plane at height z an ellipse with centre c - s (c_z - z)/s_z and
    shape P S Pᵀ. Here s is the unit vector to the sun, e_z the upward unit vector, and P = I - s e_zᵀ/s_z.
    level: True if shadows can fall only on level ground, that is, on z = 0.
    """
    sun = light.sun
    along = np.eye(3) - np.outer(sun / sun[2], [0.0, 0.0, 1.0])
    shape = along @ people.shapes.shape @ along.T
    radius = np.linalg.det(shape[..., :2, :2]) ** 0.25
    softness = 0.5 * light.penumbra / radius
    foot = people.pos3[:, None, 2]
    middle = people.shapes.centre - sun / sun[2] * (people.shapes.centre[..., 2] - foot)[..., None]
    flat = shape * ((1 + softness) ** 2)[..., None, None]
    found = image_outlines(camera, outlines(camera, Ellipsoids(middle, flat)))
    if not level:
        found = found._replace(bounds=_bounds_up_to_head(camera, people, height, sun, flat))
    return PeopleShadows(packed_inverse(shape[..., :2, :2]), softness, found)


def _bounds_up_to_head(camera: Camera, people: RecordedBodies, height: Array, sun: Array, flat: Array) -> Ints:
    half = np.sqrt(np.diagonal(flat, axis1=2, axis2=3))[..., :2]
    low_z, high_z = np.minimum(people.pos3[:, 2], 0.0), people.pos3[:, 2] + height
    corners = []
    for z in (low_z, high_z):
        middle = (
            people.shapes.centre[..., :2] - sun[:2] / sun[2] * (people.shapes.centre[..., 2] - z[:, None])[..., None]
        )
        for side in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            here = middle + half * side
            corners.append(np.concatenate([here, np.broadcast_to(z[:, None, None], (*here.shape[:2], 1))], axis=2))
    uv = project(camera, np.stack(corners, axis=1).reshape(-1, 3))[0].reshape(len(people.id), 8 * flat.shape[1], 2)
    # A shadow that reaches behind the camera may be anywhere in the image.
    behind = np.asarray(np.isnan(uv).any(axis=(1, 2)))[:, None]
    return pixel_bounds(camera, np.where(behind, 0.0, uv.min(axis=1)), np.where(behind, camera.image, uv.max(axis=1)))


def sunlit_shares(solids: Solids, pos3: Array, height: Array, sun: Array) -> Array:
    """Returns (N, 3): 1 if the sun reaches a person's feet, waist and head (columns), 0 if a solid thing hides it.

    pos3 (N, 3): feet x, y, z in m. height (N,): m. sun (3,): unit vector to the sun.
    """
    lit = np.ones((len(pos3), 3))
    if not any(len(part) for part in solids if isinstance(part, np.ndarray)):
        return lit
    from sim.scene.raycast_kernels import first_hit

    hit = np.empty(HIT_SLOTS)
    for row, place, tall in zip(lit, pos3, height, strict=True):
        for k, up in enumerate(LIT_HEIGHTS):
            row[k] = float(np.isinf(first_hit(place + np.array([0.0, 0.0, up * tall]), sun, solids, hit)))
    return lit
