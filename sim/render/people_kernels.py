"""Compiled texture pages of clothing, and the drawing of people and their shadows on a canvas.

The tests hold a slow twin of the drawing.

A page says which garment and which shade is where on a body, head or limb; a point of these is given by across (-1 left
… 1 right), along (1 front, -1 back) and up (-1 … 1).

People are drawn row by row of their outlines. A body part is a ball of radius 1 in its own axes (across, along, up,
each over its half axis). There the ray of pixel (u, v) is q = P (u, v, 1) + t D (u, v, 1), with P, D (3, 3) the
matrices of ray origins and directions and t the depth in m along the camera's axis. It meets the ball at the smaller
root t of |q| = 1; the nearest t is drawn. Only pixels inside the part's outline (`sim.scene.body.outlines`) are tested.

`draw_shadows` casts the shadows of people; of several on a pixel only the darkest counts.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.render.canvas import END_COLUMN, END_ROW, FIRST_COLUMN, FIRST_ROW, MOST, UNIT
from sim.render.canvas_kernels import mark_dirty, outline_columns
from sim.render.texture_kernels import lattice_value, value_noise
from sim.scene.body import XX, XY, YY

SHOES, TROUSERS, SHIRT, SECOND, SKIN, HAIR, CARRIED = range(7)  # rows of a person's colours (8, 3); two of CARRIED
PLAIN, HOOPS, STRIPES, PATCHES, JACKET, DRESS = range(6)  # cuts
CUT, COUNT, HEM, HAIRLINE, LEG_GAP, ARM, SLEEVE = range(7)  # slots of a person's style
BODY_PAGE, HEAD_PAGE, ARM_PAGE, PLAIN_PAGE = range(4)  # kinds of pages; PLAIN_PAGE + r has the colour of row r alone
ROUND, UP = 64, 64  # columns and rows of a page
FINE = 3  # samples each way per texel


@njit(cache=True)
def _head(across, along, up, style):  # type: ignore[no-untyped-def]
    """Returns the colour's row (HAIR or SKIN) and the shade at a point of a head."""
    if up > style[HAIRLINE] - 0.5 * max(along, 0.0) + 0.5 or (along < 0.15 and up > -0.75):
        return HAIR, 1.0
    eyes = along > 0.6 and abs(up - 0.1) < 0.12 and 0.15 < abs(across) < 0.6
    return SKIN, 0.6 if eyes else 0.75 if up < -0.75 else 1.0


@njit(cache=True)
def _body(across, along, up, round_, style, key):  # type: ignore[no-untyped-def]
    """Returns the colour's row (SHOES … SKIN) and the shade at a point of a body; round_: turn round it in [0, 4)."""
    cut, hem, count, arm = int(style[CUT]), style[HEM], style[COUNT], style[ARM]
    if up < -0.9:
        return SHOES, 1.0
    if up < hem:
        legs = min(max((-0.15 - up) * 4.0, 0.0), 1.0)
        shade = 1.0 - style[LEG_GAP] * legs * max(0.0, 1.0 - abs(across) / 0.22)  # dark between the legs
        return (SECOND if cut == DRESS and up > -0.45 else TROUSERS), shade
    if up > 0.93 or (up > 0.8 and along > 0.75):
        return SKIN, 0.85  # neck and collar
    sleeve = abs(across) > arm
    if sleeve and up < hem + 0.12:
        return SKIN, 0.95  # hands
    shade = 0.82 if abs(abs(across) - arm) < 0.05 and up < 0.75 else 1.0  # arms against the body
    hoop = cut == HOOPS and int(np.floor((up + 1.0) * count * 1.5)) % 2 == 1
    stripe = cut == STRIPES and int(np.floor(round_ * count * 1.5)) % 2 == 1
    patch = cut == PATCHES and lattice_value(int(round_ * count * 0.8), int((up + 1.0) * 2 * count), key) > 0.3
    if hoop or stripe or patch or (cut == JACKET and along > 0.5 and abs(across) < 0.22):
        return SECOND, shade
    return SHIRT, shade


@njit(cache=True)
def _arm(up, style):  # type: ignore[no-untyped-def]
    """Returns the colour's row and the shade at a point of an arm; up: of the body at whose side it hangs."""
    return (SKIN, 0.97) if up < max(style[SLEEVE], -0.02) else (SHIRT, 0.95)


@njit(cache=True)
def draw_page(style, key, colours, kind, middle, extent, out):  # type: ignore[no-untyped-def]
    """Sets out (UP, ROUND, 3) to the colours of a page of a kind, BODY_PAGE …, not clipped to 255.

    style (7,): slots CUT …. colours (C, 3): rows SHOES …. key: of the random patterns. middle, extent: the page shows
    the heights up = middle ± extent. Columns turn from the right side over the front to the left side and the back.
    """
    out[:] = 0.0
    for j in range(UP * FINE):
        up = middle + extent * (2.0 * (j + 0.5) / (UP * FINE) - 1.0)
        for i in range(ROUND * FINE):
            round_ = 4.0 * (i + 0.5) / (ROUND * FINE)
            x = 1.0 - round_ if round_ < 2.0 else round_ - 3.0  # across and along on |x| + |y| = 1, then on a circle
            y = 1.0 - abs(x) if round_ < 2.0 else abs(x) - 1.0
            size = np.hypot(x, y)
            if kind == BODY_PAGE:
                row, shade = _body(x / size, y / size, up, round_, style, key)
            elif kind == HEAD_PAGE:
                row, shade = _head(x / size, y / size, up, style)
            else:
                row, shade = _arm(up, style) if kind == ARM_PAGE else (kind - PLAIN_PAGE, 1.0)
            folds = 0.14 * value_noise(3.0 * round_ + 0.6 * up, 3.0 * up, key) + 0.10 * value_noise(
                4.0 * round_, 14.0 * up, key + 1
            )
            cloth = shade * (1.0 + (folds if row != SKIN else 0.4 * folds))
            for k in range(3):
                out[j // FINE, i // FINE, k] += colours[row, k] * cloth / (FINE * FINE)


P_AT_0, P_PER_COLUMN, D_AT_0, D_PER_COLUMN = range(4)  # columns of `ray`, its rows being the part's own axes
X, Y, Z = range(3)
LOWER, MIDDLE, UPPER = range(3)  # columns of `sunlit`


@njit(cache=True)
def _row_of_rays(i, e, v, seen, ray):  # type: ignore[no-untyped-def]
    """Sets ray (3, 4) to the rays of image row v in the own axes of part e of person i, a ball of radius 1."""
    start, step = seen.start, seen.step
    for k in range(3):
        ray[k, P_AT_0] = start[i, e, k, 1] * (v + 0.5) + start[i, e, k, 2]
        ray[k, P_PER_COLUMN] = start[i, e, k, 0]
        ray[k, D_AT_0] = step[i, e, k, 1] * (v + 0.5) + step[i, e, k, 2]
        ray[k, D_PER_COLUMN] = step[i, e, k, 0]


@njit(cache=True)
def _hit_depths(ray, left, many, t):  # type: ignore[no-untyped-def]
    """Sets t (many,) to the depths m at which a row's rays meet the unit ball; a miss gives its nearest point."""
    px0, px1, dx0, dx1 = ray[X, P_AT_0], ray[X, P_PER_COLUMN], ray[X, D_AT_0], ray[X, D_PER_COLUMN]
    py0, py1, dy0, dy1 = ray[Y, P_AT_0], ray[Y, P_PER_COLUMN], ray[Y, D_AT_0], ray[Y, D_PER_COLUMN]
    pz0, pz1, dz0, dz1 = ray[Z, P_AT_0], ray[Z, P_PER_COLUMN], ray[Z, D_AT_0], ray[Z, D_PER_COLUMN]
    for k in range(many):
        x = left + k + 0.5
        px, dx = px1 * x + px0, dx1 * x + dx0
        py, dy = py1 * x + py0, dy1 * x + dy0
        pz, dz = pz1 * x + pz0, dz1 * x + dz0
        a, b = dx * dx + dy * dy + dz * dz, px * dx + py * dy + pz * dz
        root = b * b - a * (px * px + py * py + pz * pz - 1.0)
        t[k] = (-b - np.sqrt(root if root > 0.0 else 0.0)) / a


@njit(cache=True)
def _texture_and_light(  # type: ignore[no-untyped-def]
    ray, left, many, t, half, sun, shadow, sunlit, place, across, up, light
):
    """Sets where on a texture page the points at depths t (many,) are, and how they are lit.

    place (many,): index of the lower left of four texels; across, up (many,): how far beyond it; light (many,):
    brightness times UNIT. half (3,) m: half axes. sun (3,): in own axes. sunlit (3,): columns LOWER …. Float32, exact
    to 1e-4 of a page.
    """
    f = np.float32
    px0, px1 = f(ray[X, P_AT_0]), f(ray[X, P_PER_COLUMN])
    dx0, dx1 = f(ray[X, D_AT_0]), f(ray[X, D_PER_COLUMN])
    py0, py1 = f(ray[Y, P_AT_0]), f(ray[Y, P_PER_COLUMN])
    dy0, dy1 = f(ray[Y, D_AT_0]), f(ray[Y, D_PER_COLUMN])
    pz0, pz1 = f(ray[Z, P_AT_0]), f(ray[Z, P_PER_COLUMN])
    dz0, dz1 = f(ray[Z, D_AT_0]), f(ray[Z, D_PER_COLUMN])
    h0, h1, h2 = f(1.0 / half[0]), f(1.0 / half[1]), f(1.0 / half[2])
    # Lambert's law for the sun; the sky's light comes more from above than from the side.
    low_sun = shadow / max(sun[2], 0.3)
    s0, s1, s2 = f(sun[0] * low_sun), f(sun[1] * low_sun), f(sun[2] * low_sun)
    half_lit, above, below = f(sunlit[MIDDLE]), f(sunlit[UPPER] - sunlit[MIDDLE]), f(sunlit[LOWER] - sunlit[MIDDLE])
    sky, zero, one = f(UNIT * (1.0 - shadow)), f(0.0), f(1.0)
    for k in range(many):
        x, depth = f(left + k) + f(0.5), f(t[k])
        qx = px1 * x + px0 + depth * (dx1 * x + dx0)
        qy = py1 * x + py0 + depth * (dy1 * x + dy0)
        qz = pz1 * x + pz0 + depth * (dz1 * x + dz0)
        nx, ny, nz = qx * h0, qy * h1, qz * h2
        size = one / np.sqrt(nx * nx + ny * ny + nz * nz)
        facing = nx * s0 + ny * s1 + nz * s2
        facing = (facing if facing > zero else zero) * size
        facing *= half_lit + (above * qz if qz > zero else -below * qz)
        light[k] = sky * (f(0.8) + f(0.2) * nz * size) + f(UNIT) * facing
        share = qx / (abs(qx) + abs(qy) + f(1e-12))
        x = (one - share if qy >= zero else f(3.0) + share) * f(0.25 * ROUND) - f(0.5)
        x = x if x >= zero else x + f(ROUND)
        y = (qz + one) * f(0.5 * UP) - f(0.5)
        y = min(max(y, zero), f(UP - 1.001))
        i, j = np.int32(x), np.int32(y)
        across[k], up[k] = x - f(i), y - f(j)
        place[k] = j * np.int32(ROUND + 1) + i


@njit(cache=True)
def _part_rows(i, e, outlines):  # type: ignore[no-untyped-def]
    """Returns the first row and the last + 1 of the pixels that part e of person i may cover; none if it is nan."""
    a, b, c = outlines.inverse[i, e, XX], outlines.inverse[i, e, XY], outlines.inverse[i, e, YY]
    half, middle = np.sqrt(a / (a * c - b * b)), outlines.middle[i, e, 1]
    if not half >= 0.0:
        return 0, 0
    first, end = outlines.bounds[i, FIRST_ROW], outlines.bounds[i, END_ROW]
    return int(max(middle - half - 1.0, float(first))), int(min(middle + half + 1.0, float(end)))


@njit(cache=True)
def count_silhouettes(rows, outlines, width, amodal):  # type: ignore[no-untyped-def]
    """Sets amodal (N,) to the pixels of the whole silhouettes of the people of these rows, hidden ones included."""
    parts = outlines.middle.shape[1]
    lows, highs = np.empty(parts, np.int64), np.empty(parts, np.int64)
    for i in rows:
        for v in range(outlines.bounds[i, FIRST_ROW], outlines.bounds[i, END_ROW]):
            # Runs of columns, sorted by their begin.
            n = 0
            for e in range(parts):
                low, high = outline_columns(v, i, e, outlines, width)
                if high > low:
                    k = n
                    while k > 0 and lows[k - 1] > low:
                        lows[k], highs[k] = lows[k - 1], highs[k - 1]
                        k -= 1
                    lows[k], highs[k] = low, high
                    n += 1
            end = 0
            for k in range(n):
                amodal[i] += max(highs[k] - max(lows[k], end), 0)
                end = max(end, highs[k])


@njit(cache=True)
def draw_people(rows, seen, shadow, atlas, shade, label, canvas, ids, margin):  # type: ignore[no-untyped-def]
    """Draws the people, or things, of these rows by depth; only the speed depends on the order of the rows.

    seen: PeopleInView of N people. shadow: the sun's share of the light. With `label`, ids (H, W) gets the ids of
    visible people. With `shade`, colours are drawn.
    """
    width, depth, colour, outlines = canvas.depth.shape[1], canvas.depth, canvas.colour, seen.outlines
    t, ray = np.empty(width), np.empty((3, 4))
    place, one = np.empty(width, np.int32), np.float32(1.0)
    across, up, light = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    for i in rows:
        for e in range(seen.page.shape[1]):
            page = atlas[seen.page[i, e]]
            first_row, end_row = _part_rows(i, e, outlines)
            for v in range(first_row, end_row):
                low, high = outline_columns(v, i, e, outlines, width)
                if low == high:
                    continue
                _row_of_rays(i, e, v, seen, ray)
                _hit_depths(ray, low, high - low, t)
                shown = 0
                for u in range(low, high):
                    near = t[u - low]
                    if near <= 0.0 or near >= depth[v, u]:
                        t[u - low] = -1.0
                        continue
                    shown += 1
                    depth[v, u] = near
                    if label:
                        ids[v, u] = seen.id[i]
                if shown == 0:
                    continue
                mark_dirty(canvas, v, low, high, margin)
                if not shade:
                    continue
                half, sun, sunlit = seen.half[i, e], seen.sun[i, e], seen.sunlit[i, e]
                _texture_and_light(ray, low, high - low, t, half, sun, shadow, sunlit, place, across, up, light)
                for u in range(low, high):
                    n = u - low
                    if t[n] > 0.0:
                        a, b, here, beneath = across[n], up[n], 3 * place[n], 3 * (place[n] + ROUND + 1)
                        for k in range(3):
                            first = np.float32(page[here + k]) * (one - a) + np.float32(page[here + 3 + k]) * a
                            second = np.float32(page[beneath + k]) * (one - a) + np.float32(page[beneath + 3 + k]) * a
                            c = (first * (one - b) + second * b) * light[n]
                            colour[v, u, k] = np.int16(np.int32(min(c, np.float32(MOST))))


@njit(cache=True)
def _shade_line(xs, ys, zs, many, centre, shape, sx, sy, softness, shade):  # type: ignore[no-untyped-def]
    """Raises shade (many,) to 255 times the share of the sun that one body part takes at the places xs, ys, zs, m."""
    f = np.float32
    x, y, z, a, b, c = f(centre[0]), f(centre[1]), f(centre[2]), f(shape[XX]), f(2 * shape[XY]), f(shape[YY])
    slope_x, slope_y, zero, one, most = f(sx), f(sy), f(0.0), f(1.0), f(255.0)
    edge, per = f(1.0 + softness), f(1.0 / max(2 * softness, 1e-6))
    for k in range(many):
        above = z - zs[k]
        dx, dy = xs[k] - x + slope_x * above, ys[k] - y + slope_y * above
        q = dx * dx * a + dx * dy * b + dy * dy * c
        share = (edge - np.sqrt(max(q, zero))) * per
        share = share if above > zero else zero
        dark = most * min(max(share, zero), one)
        shade[k] = max(shade[k], dark)


@njit(cache=True)
def draw_shadows(rows, place, direct, level, centre, shadows, sun, canvas, margin):  # type: ignore[no-untyped-def]
    """Darkens the canvas where the people of these rows stand before the sun; of several shadows, the darkest counts.

    place (3, H, W) m, direct (H, W): of the empty scene. level: True if only level ground is in view. centre (N, K, 3)
    m: of the ellipsoids. shadows: PeopleShadows of N people.
    """
    width, colour, shaded = direct.shape[1], canvas.colour, canvas.shaded
    outlines, bounds = shadows.outlines, shadows.outlines.bounds
    sx, sy = sun[0] / sun[2], sun[1] / sun[2]
    shade, half = np.empty(width, np.float32), np.float32(0.5)
    for i in rows:
        for v in range(bounds[i, FIRST_ROW], bounds[i, END_ROW]):
            low, high = bounds[i, FIRST_COLUMN], bounds[i, END_COLUMN]
            if level:
                low, high = width, 0
                for e in range(centre.shape[1]):
                    first, last = outline_columns(v, i, e, outlines, width)
                    if last > first:
                        low, high = min(low, first), max(high, last)
            if high <= low:
                continue
            shade[: high - low] = 0.0
            for e in range(centre.shape[1]):
                shape, softness = shadows.shape[i, e], shadows.softness[i, e]
                xs, ys, zs = place[0, v, low:], place[1, v, low:], place[2, v, low:]
                _shade_line(xs, ys, zs, high - low, centre[i, e], shape, sx, sy, softness, shade)
            left, right = width, 0
            for u in range(low, high):
                new, old = int(shade[u - low] + half), int(shaded[v, u])
                if new > old:
                    left, right = min(left, u), u + 1
                    shaded[v, u] = new
                    part = direct[v, u] * np.float32(1.0 / 255.0)
                    factor = (np.float32(1.0) - part * np.float32(new)) / (np.float32(1.0) - part * np.float32(old))
                    for k in range(3):
                        colour[v, u, k] = np.int16(np.int32(np.float32(colour[v, u, k]) * factor))
            mark_dirty(canvas, v, left, right, margin)
