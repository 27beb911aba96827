"""Compiled painting of the empty scene as a camera sees it, ray by ray.

From the rays of the pixels and the solid things of the scene it computes for each pixel: depth (m), kind of surface,
place in the world (m), colour (BGR, grey levels), share of direct sun, and share covered by plants (both 0 to 1).
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.air_kernels import lamp_light, night
from sim.render.materials import BRICK, GRASS, GREY, SKY, STEP, STONE, WALLS

# isort: off
# fmt: off
from sim.render.texture_kernels import (
    COS, HOUSES, SIN, contrast_kept, facade, grain, lattice_value, paint_lines, parked_car, plant_cover, poster,
    skyline, slabs, stain, value_noise,
)
from sim.scene.raycast import (
    BOX, GROUND, HIT_INDEX, HIT_KIND, HIT_PLACE, HIT_SLOTS, NORMAL_X, NOTHING, PILLAR, RISER, TREAD, WALL,
)
# fmt: on
# isort: on
from sim.scene.boxes import AXES, COLOUR, GLOSS, HALF, MIDDLE, PATTERN, PATTERNS, PERIOD
from sim.scene.raycast_kernels import first_hit, has_solids, look

PANELS, WINDOWS = WALLS.index("panels"), WALLS.index("windows")
KERB = 0.1  # m: borders less ragged have kerbstones
PAINT = 225.0  # grey level of painted lines at full light
SKY_DISTANCE = 200.0  # m: what fog hides of the sky
POINT, NORMAL, SPARE, BLOCKED, MIRRORED, REFLECTION = range(6)  # rows of the scratch `more`
PLAIN, STRIPES = PATTERNS.index("plain"), PATTERNS.index("stripes")
BOX_KEY = 200  # of the grain of boxes, which is another on each
SUN_LEVEL = 1500.0  # grey levels of the sun's image in a glossy side, before it is clipped


@njit(cache=True)
def _tint(base, brightness, warmth, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to a palette colour, BGR, made brighter and warmer by these shares."""
    out[0] = base[0] * max(0.0, 1 + brightness - warmth)
    out[1] = base[1] * max(0.0, 1 + brightness)
    out[2] = base[2] * max(0.0, 1 + brightness + warmth)


@njit(cache=True)
def _ground(x, y, size, footprint, slope, style, palette, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to the colour of the ground at (x, y) m; returns (is it grass, share covered by plants)."""
    contrast, slab, key = style.contrast, style.slab_width, style.key
    # A ragged border, outside the world, between paving and grass.
    outside = max(max(-x, x - size[0]), max(-y, y - size[1])) - style.verge
    if style.road[2] < np.inf:
        bend = 0.6 * value_noise(0.08 * x, 0.08 * y, key + 91)
        off = style.road[0] * (y - 0.5 * size[1]) - style.road[1] * (x - 0.5 * size[0])
        outside = max(outside, abs(off + bend) - style.road[2])
    kerb = style.ragged < KERB and -0.15 < outside < 0.0
    outside += style.ragged * value_noise(x, y, key + 90)
    patches = value_noise(0.31 * x, 0.31 * y, key + 20) + 0.6 * value_noise(0.9 * x + 7.3, 0.9 * y, key + 21)
    warmth = contrast * 0.06 * value_noise(0.5 * x, 0.5 * y + 3.1, key + 22)
    fine = grain(x, y, key, footprint, style.coarsest)
    if outside > 0:
        _tint(palette[GRASS], contrast * (0.4 * fine + 0.16 * style.mottle * patches), warmth, out)
    else:
        tile = slabs(x, y, slab, style.slab_shape * slab, 0.012, key + 40, footprint) if slab > 0 else 0.0
        shade = style.grain * fine + 0.1 * style.mottle * patches + style.tile * tile
        _tint(palette[GREY], contrast * shade, warmth, out)
        if kerb:
            _tint(out, 0.3 * contrast_kept(0.15, footprint), 0.0, out)
        if style.paint > 0:
            paint = style.paint * paint_lines(x, y, key + 200, footprint)
            for k in range(3):
                out[k] += paint * (PAINT - out[k])
    if style.stains > 0:
        _tint(out, style.stains * stain(x, y, key + 210, footprint), 0.0, out)
    if style.wet > 0:
        # Schlick's reflectance of water, more where it stands in puddles.
        puddle = min(max(2.0 * patches + 4.0 * style.wet - 2.0, 0.0), 1.0)
        mirror = style.wet * (0.4 + 0.6 * puddle) * (0.02 + 0.98 * (1 - slope) ** 5)
        for k in range(3):
            out[k] += mirror * palette[SKY, k] - min(0.45 * style.wet + mirror, 1.0) * out[k]
    level = style.plant_level
    plants = plant_cover(x, y, size, style.plant_key, level, footprint) if level < np.inf else 0.0
    if plants > 0.0:
        turned = grain(COS * x - SIN * y, SIN * x + COS * y, key + 50, footprint, 0.3)
        leaves = 0.85 - 0.3 * contrast + 1.3 * contrast * turned
        for k in range(3):
            out[k] += plants * (palette[GRASS, k] * max(leaves, 0.15) - out[k])
    return outside > 0, plants


@njit(cache=True)
def _upright(kind, along, z, footprint, style, palette, key, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to the colour of a wall, pillar or step at a place (along, z) m on its surface."""
    fine, contrast = grain(along, z, key + 60, footprint, 0.6), style.contrast
    if kind == WALL and style.walls > 0:
        shade = 0.06 * fine + 0.1 * value_noise(0.4 * along, 0.7 * z, key + 62)
        shade += 0.1 * slabs(along, z, 1.2, 2.4, 0.015, key + 61, footprint) if style.walls == PANELS else 0.0
        windows = facade(along, z, key + 63, footprint) if style.walls == WINDOWS else 0.0
        shown, light, warmth = poster(along, z, key + 64)
        shown = shown and style.walls != WINDOWS
        _tint(palette[BRICK], contrast * shade + (light if shown else windows), warmth if shown else 0.0, out)
    elif kind == WALL:
        tile = slabs(along, z, 0.5, 0.25, 0.012, key + 61, footprint)
        low = 0.35 * contrast_kept(0.3, footprint) if z < 0.12 else 0.0
        _tint(palette[BRICK], contrast * (0.3 * fine + 0.22 * tile) - low, contrast * 0.05 * tile, out)
    else:
        row = STONE if kind == PILLAR else STEP
        edge = -0.18 if kind == RISER else 0.0
        _tint(palette[row], contrast * (0.4 if style.walls == 0 else 0.15) * fine + edge, 0.0, out)


@njit(cache=True)
def _square_wave(x, period, footprint):  # type: ignore[no-untyped-def]
    """Returns a square wave at x m, from -1 to 1, whose edges are as wide as a pixel."""
    phase = x / period - np.floor(x / period)
    return min(max((1.0 - 4.0 * abs(phase - 0.5)) * 0.5 * period / footprint, -1.0), 1.0)


@njit(cache=True)
def _box_side(point, side, box, footprint, contrast, key, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to the colour of a box (22,) at a point (3,) m of the side perpendicular to its axis `side`."""
    place = (1 if side == 0 else 0), (1 if side == 2 else 2)
    x = y = 0.0
    for k in range(3):
        x += (point[k] - box[MIDDLE + k]) * box[AXES + 3 * place[0] + k]
        y += (point[k] - box[MIDDLE + k]) * box[AXES + 3 * place[1] + k]
    x, y = x + box[HALF + place[0]], y + box[HALF + place[1]]
    pattern, period, value = int(box[PATTERN]), box[PERIOD], 0.0
    if pattern == 0:
        value = 0.5 * grain(x, y, key, footprint, 0.4)
    elif pattern != PLAIN:
        value = _square_wave(x, period, footprint) * (0.6 * contrast_kept(period, footprint))
        if pattern != STRIPES:
            value *= _square_wave(y, period, footprint)
    _tint(box[COLOUR : COLOUR + 3], contrast * value, 0.0, out)


@njit(cache=True)
def _sky(d, key, palette, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to the colour of the sky in direction d (3,), which is not below the horizon."""
    length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    up = max(d[2] / length, 0.0)
    x, y = d[0] / (d[2] + 0.1 * length), d[1] / (d[2] + 0.1 * length)
    cloud = value_noise(0.4 * x, 0.4 * y, key + 80) + 0.5 * value_noise(x, y, key + 81)
    _tint(palette[SKY], 0.08 * cloud - 0.15 * up, -0.12 * up, out)


@njit(cache=True)
def _facing(normal, sun):  # type: ignore[no-untyped-def]
    """Returns the sun's light on a surface that nothing shades, over that on level ground (in a low sun, over 0.3)."""
    return max(0.0, normal[0] * sun[0] + normal[1] * sun[1] + normal[2] * sun[2]) / max(sun[2], 0.3)


@njit(cache=True)
def _sunlit(point, normal, sun, penumbra, solids, spare, hit):  # type: ignore[no-untyped-def]
    """Returns the share of four points across the penumbra from which no solid thing hides the sun."""
    if not has_solids(solids):
        return 1.0
    share = 0.0
    for k in range(4):
        # A little off the surface, which would else hide itself.
        spare[0] = point[0] + 1e-4 * normal[0] + penumbra * ((k % 2) - 0.5) * 0.7
        spare[1] = point[1] + 1e-4 * normal[1] + penumbra * ((k // 2) - 0.5) * 0.7
        spare[2] = point[2] + 1e-4 * normal[2]
        if np.isinf(first_hit(spare, sun, solids, hit)):
            share += 0.25
    return share


@njit(cache=True)
def _meet_backdrop(o, d, nearest, style):  # type: ignore[no-untyped-def]
    """Returns the t at which a ray meets the backdrop, a square round the camera, and where: m along it, m up.

    t is inf if it meets none, or something at `nearest` before it.
    """
    if style.backdrop == 0 or style.far[2] == np.inf:
        return np.inf, 0.0, 0.0
    x, y, half = o[0] - style.far[0], o[1] - style.far[1], style.far[2]
    tx = ((half if d[0] > 0 else -half) - x) / d[0] if d[0] != 0.0 else np.inf
    ty = ((half if d[1] > 0 else -half) - y) / d[1] if d[1] != 0.0 else np.inf
    t = min(tx, ty)
    z = o[2] + t * d[2]
    # Each side has patterns of its own.
    along = y + t * d[1] + (1000.0 if d[0] > 0 else 2000.0) if tx < ty else x + t * d[0] + (0.0 if d[1] > 0 else 3000.0)
    if t >= nearest or z < 0 or z > skyline(style.backdrop, along, style.key + 220):
        return np.inf, 0.0, 0.0
    return t, along, z


@njit(cache=True)
def _backdrop(along, z, footprint, style, palette, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to the colour of the backdrop at a place (along, z) m on it."""
    key = style.key + 230
    if style.backdrop == HOUSES:
        house = int(np.floor(along / 11.0))
        own = 0.35 * lattice_value(house, 1, key)
        shade = own + facade(along, z, key + house, footprint) + 0.06 * grain(along, z, key, footprint, 0.6)
        _tint(palette[BRICK], shade, 0.12 * lattice_value(house, 2, key), out)
    else:
        leaves = grain(along, z, key, footprint, 0.7) + 0.5 * value_noise(0.7 * along, 0.7 * z, key + 1)
        _tint(palette[GRASS], -0.35 + 0.6 * style.contrast * leaves, 0.0, out)
    level, warmth = parked_car(along, z, key + 2)
    if level >= 0.0:
        out[0], out[1], out[2] = level * (1 - warmth), level, level * (1 + warmth)


@njit(cache=True)
def trace_pixels(rays, solids, style, depth, kind, place):  # type: ignore[no-untyped-def]
    """Sets depth (H, W), kind (H, W) and place (3, H, W) to what the centre of each pixel shows.

    Sky has depth inf and place 1e9; the backdrop is of the kind NOTHING, too.
    """
    height, width = depth.shape
    o, d, hit = np.empty(3), np.empty(3), np.empty(HIT_SLOTS)
    for v in range(height):
        for u in range(width):
            t = look(rays, u + 0.5, v + 0.5, solids, o, d, hit)
            behind = _meet_backdrop(o, d, t, style)[0]
            t, kind[v, u] = (behind, NOTHING) if behind < t else (t, int(hit[HIT_KIND]))
            depth[v, u] = t
            for k in range(3):
                place[k, v, u] = o[k] + t * d[k] if t < 1e9 else 1e9


@njit(cache=True)
def _surface(hit, point, solids, size, footprint, slope, style, palette, out):  # type: ignore[no-untyped-def]
    """Sets out (3,) to the unlit colour of a hit at a point (3,) m; returns (is it grass, share of plants)."""
    kind, index, key = int(hit[HIT_KIND]), int(hit[HIT_INDEX]), style.key
    if kind == GROUND:
        return _ground(point[0], point[1], size, footprint, slope, style, palette, out)
    if kind == BOX:
        own = key + BOX_KEY + 16 * index
        _box_side(point, int(hit[HIT_PLACE]), solids.boxes[index], footprint, style.contrast, own, out)
    elif kind == TREAD:
        _upright(kind, point[0], point[1], footprint, style, palette, key + 7 * index, out)
    else:
        _upright(kind, hit[HIT_PLACE], point[2], footprint, style, palette, key + 7 * index + 1, out)
    return False, 0.0


@njit(cache=True)
def _mirror(d, scale, distance, sun, shadow, solids, size, style, palette, more):  # type: ignore[no-untyped-def]
    """Sets more[REFLECTION] to the colour that a side at more[POINT], more[NORMAL] mirrors, seen along d (3,).

    distance: from the camera, m. It mirrors the empty scene without cast shadows and further mirrors, and the sun where
    it shows the sky.
    """
    point, normal, start, hit = more[POINT], more[NORMAL], more[SPARE], more[BLOCKED]
    r, out = more[MIRRORED], more[REFLECTION]
    along = d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]
    for k in range(3):
        r[k] = d[k] - 2.0 * along * normal[k]
        start[k] = point[k] + 1e-4 * normal[k]
    t = first_hit(start, r, solids, hit)
    if int(hit[HIT_KIND]) == NOTHING:
        _sky(r, style.key, palette, out)
        length = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
        lobe = max(r[0] * sun[0] + r[1] * sun[1] + r[2] * sun[2], 0.0) / length
        for _ in range(9):  # the 512th power: half as bright 3 degrees beside the sun's image
            lobe *= lobe
        for k in range(3):
            out[k] += SUN_LEVEL * shadow * lobe
        return
    for k in range(3):
        start[k] += t * r[k]
    footprint = (distance + t if scale > 0 else 1.0) / abs(scale)
    _surface(hit, start, solids, size, footprint, 1.0, style, palette, out)
    light = (1 - shadow) * (0.85 + 0.15 * hit[NORMAL_X + 2]) + shadow * _facing(hit[NORMAL_X:], sun)
    for k in range(3):
        out[k] *= light


@njit(cache=True)
def _point_colour(  # type: ignore[no-untyped-def]
    x, y, rays, scale, sun, shadow, penumbra, solids, size, style, palette, o, d, hit, more, out
):
    """Sets out (3,) to the colour seen through the image point (x, y) px, shaded by solid things and hazy.

    Returns the share of direct sun in its light, the share covered by plants, and a whole number that is equal for
    points of one surface lit alike. Arguments as of `paint_pixels`; o, d (3,), hit (6,), more (6, 6): scratch.
    """
    t = look(rays, x, y, solids, o, d, hit)
    kind, key = int(hit[HIT_KIND]), style.key
    behind, along, up = _meet_backdrop(o, d, t, style)
    if kind == NOTHING or behind < t:
        if behind < t:
            _backdrop(along, up, behind / abs(scale), style, palette, out)
        else:
            _sky(d, key, palette, out)
        haze = 1 - np.exp(-style.fog * min(behind, SKY_DISTANCE))
        for k in range(3):
            out[k] = night(style) * (out[k] * (1 - haze) + palette[SKY, k] * haze)
        return 0.0, 0.0, 1 if behind < t else 0
    point, normal, spare, blocked = more[POINT], more[NORMAL], more[SPARE], more[BLOCKED]
    for k in range(3):
        point[k], normal[k] = o[k] + t * d[k], hit[NORMAL_X + k]
    slope = abs(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2])
    slope /= np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    # There is no haze from above.
    distance = t if scale > 0 else 1.0
    footprint = distance / abs(scale) / np.sqrt(max(slope, 0.02))
    index = int(hit[HIT_INDEX])
    grass, plants = _surface(hit, point, solids, size, footprint, slope, style, palette, out)
    facing = _facing(normal, sun)
    lit = _sunlit(point, normal, sun, penumbra, solids, spare, blocked) if shadow > 0 and facing > 0 else 0.0
    sunlight = shadow * facing * lit
    light = (1 - shadow) * (0.85 + 0.15 * normal[2]) + sunlight
    haze = 1 - np.exp(-max(distance - 25.0, 0.0) / 120.0 - style.fog * distance)
    lamps, dark, mirrored = lamp_light(point[0], point[1], style), night(style), 0.0
    if kind == BOX and solids.boxes[index, GLOSS] > 0.0:
        mirrored = solids.boxes[index, GLOSS]
        mirrored += (1.0 - mirrored) * (1.0 - slope) ** 5
        _mirror(d, scale, distance, sun, shadow, solids, size, style, palette, more)
    for k in range(3):
        shown = out[k] * light * lamps
        if mirrored > 0.0:
            shown += mirrored * (more[REFLECTION, k] * dark - shown)
        out[k] = shown * (1 - haze) + palette[SKY, k] * dark * haze
    level = int(np.rint(1000 * point[2])) if kind == TREAD else int(2 * normal[0]) + 7 * int(2 * normal[1])
    if kind == BOX:
        level = int(hit[HIT_PLACE])
    surface = ((level * 64 + index) * 5 + int(4 * lit)) * 16 + 2 * kind + (1 if grass else 0)
    return sunlight * (1 - haze) / light * (1.0 - mirrored), plants, surface


@njit(cache=True)
def paint_pixels(  # type: ignore[no-untyped-def]
    rays, samples, scale, sun, shadow, penumbra, solids, size, style, palette, colour, direct, plants
):
    """Sets colour (H, W, 3) BGR, and the shares direct (H, W) of sun and plants (H, W), of samples x samples rays.

    scale: px per m at a depth of 1 m, or minus px per m for a
    camera from above. sun (3,): unit vector to the sun. shadow: the sun's share of the light. penumbra: m. size (2,) m:
    of the world. style: Style. palette (6, 3): rows GREY ….
    """
    height, width = direct.shape
    o, d, hit, more, c = np.empty(3), np.empty(3), np.empty(HIT_SLOTS), np.empty((6, HIT_SLOTS)), np.empty(3)
    surface = np.empty((height, width), np.int64)
    for turn in range(2 if samples == 1 else 1):
        many = 2 if turn else samples
        share = 1.0 / (many * many)
        for v in range(height):
            for u in range(width):
                here = surface[v, u]
                if (
                    # Only edges need more rays: pixels that differ from a neighbour in surface or sunlight.
                    turn == 1
                    and here == surface[max(v - 1, 0), u]
                    and here == surface[min(v + 1, height - 1), u]
                    and here == surface[v, max(u - 1, 0)]
                    and here == surface[v, min(u + 1, width - 1)]
                ):
                    continue
                colour[v, u, 0], colour[v, u, 1], colour[v, u, 2] = 0.0, 0.0, 0.0
                direct[v, u], plants[v, u] = 0.0, 0.0
                for ray in range(many * many):
                    x, y = u + (ray % many + 0.5) / many, v + (ray // many + 0.5) / many
                    sunny, green, here = _point_colour(
                        x, y, rays, samples * scale, sun, shadow, penumbra, solids, size, style, palette,
                        o, d, hit, more, c,
                    )  # fmt: skip
                    direct[v, u] += share * sunny
                    plants[v, u] += share * green
                    for k in range(3):
                        colour[v, u, k] += share * c[k]
                if turn == 0:
                    surface[v, u] = here
