"""Compiled loops of `sim.scene.visibility`: which sample points of a person's silhouette in the image are visible.

A sample is hidden by nearer people, walls, pillars, stairs, boxes or things. The tests compare the result with a numpy
implementation.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.scene.body import XX, XY, YY
from sim.scene.raycast import CENTRE_X, CENTRE_Y, HIT_SLOTS, RADIUS, X1, X2, Y1, Y2
from sim.scene.raycast_kernels import at_pixel, first_hit, hit_pillar, hit_wall

COLUMNS, ROWS = 16, 32  # cells laid over each amodal box, one sample in the middle of each
LEFT, TOP, WIDTH, HEIGHT = range(4)  # columns of boxes


@njit(cache=True)
def _inside(centre, inverse, i, u, v):  # type: ignore[no-untyped-def]
    """Returns True if image point (u, v) lies in a part of person i."""
    for part in range(centre.shape[1]):
        x, y = u - centre[i, part, 0], v - centre[i, part, 1]
        if x * x * inverse[i, part, XX] + 2 * x * y * inverse[i, part, XY] + y * y * inverse[i, part, YY] <= 1.0:
            return True
    return False


@njit(cache=True)
def _overlap(a, b):  # type: ignore[no-untyped-def]
    """Returns True if two boxes (4,) overlap."""
    return (
        b[LEFT] < a[LEFT] + a[WIDTH]
        and a[LEFT] < b[LEFT] + b[WIDTH]
        and b[TOP] < a[TOP] + a[HEIGHT]
        and a[TOP] < b[TOP] + b[HEIGHT]
    )


@njit(cache=True)
def _nearer_people(i, first, last, box, distance, found):  # type: ignore[no-untyped-def]
    """Writes to `found` the rows of first … last - 1 that may hide person i; returns how many."""
    n = 0
    for j in range(first, last):
        if distance[j] > distance[i] or (distance[j] == distance[i] and j >= i):
            continue
        if _overlap(box[i], box[j]):
            found[n] = j
            n += 1
    return n


@njit(cache=True)
def _first_part(o, d, centre, inverse):  # type: ignore[no-untyped-def]
    """Returns where the ray o + s d first meets one of K ellipsoids, centre (K, 3), inverse (K, 3, 3); inf if none."""
    best = np.inf
    for k in range(len(centre)):
        a = b = c = 0.0
        for x in range(3):
            wx = o[x] - centre[k, x]
            for y in range(3):
                wy, m = o[y] - centre[k, y], inverse[k, x, y]
                a, b, c = a + d[x] * m * d[y], b + wx * m * d[y], c + wx * m * wy
        root = b * b - a * (c - 1.0)
        if root >= 0.0:
            s = (-b - np.sqrt(root)) / a
            if 0.0 < s < best:
                best = s
    return best


@njit(cache=True)
def _behind_a_thing(i, u, v, near, n, things, o, d):  # type: ignore[no-untyped-def]
    """Returns True if the ray through (u, v) meets one of the first n things in `near` before person i."""
    at_pixel(things.rays.origin, u, v, o)
    at_pixel(things.rays.direction, u, v, d)
    own = _first_part(o, d, things.own_centre[i], things.own_inverse[i])
    first = np.inf
    for k in range(n):
        first = min(first, _first_part(o, d, things.centre[near[k]], things.inverse[near[k]]))
    return first < own


@njit(cache=True)
def _walls_between(x, y, eye, walls, found):  # type: ignore[no-untyped-def]
    """Writes to `found` the walls whose line separates (x, y) from the eye; returns how many."""
    n = 0
    for w in range(len(walls)):
        ax, ay = walls[w, X1], walls[w, Y1]
        ex, ey = walls[w, X2] - ax, walls[w, Y2] - ay
        if (ex * (y - ay) - ey * (x - ax)) * (ex * (eye[1] - ay) - ey * (eye[0] - ax)) < 0:
            found[n] = w
            n += 1
    return n


@njit(cache=True)
def _pillars_before(x, y, eye, pillars, found):  # type: ignore[no-untyped-def]
    """Writes to `found` the pillars that may hide (x, y) from the eye; returns how many."""
    n = 0
    dx, dy = x - eye[0], y - eye[1]
    for p in range(len(pillars)):
        px, py = pillars[p, CENTRE_X] - eye[0], pillars[p, CENTRE_Y] - eye[1]
        if dx * dx + dy * dy > px * px + py * py - pillars[p, RADIUS] * pillars[p, RADIUS] and px * dx + py * dy > 0:
            found[n] = p
            n += 1
    return n


@njit(cache=True)
def visible_span(start, length, cells, low, high, first, last, limit):  # type: ignore[no-untyped-def]
    """Returns start and length in px of the cells low … high along one axis of a box, clipped to 0 … limit.

    first, last: outermost of the cells that the silhouette covers; where they are visible, the span reaches the box's
    edge.
    """
    a = start + (0 if low == first else low) * length / cells
    b = start + (cells if high == last else high + 1) * length / cells
    a = max(a, 0.0)
    return a, min(b, limit) - a


@njit(cache=True)
def _meets_any(d, eye, between, n_walls, before, n_pillars, solids, hit):  # type: ignore[no-untyped-def]
    """Returns True if the ray eye + s d meets one of the first n_walls walls or n_pillars pillars that are listed."""
    for k in range(n_walls):
        if hit_wall(eye, d, solids.walls[between[k]], solids.wall_height, hit, np.inf, k) < np.inf:
            return True
    for k in range(n_pillars):
        if hit_pillar(eye, d, solids.pillars[before[k]], solids.pillar_height, hit, np.inf, k) < np.inf:
            return True
    return False


@njit(cache=True)
def sample_visibility(  # type: ignore[no-untyped-def]
    starts, box, centre, inverse, distance, pos, image_size, eye, unproject, solids, stairs, things
):
    """Returns visibility (R,), truncation (R,) and visible boxes (R, 4) px of R people.

    starts (F + 1,): first row of each frame. box (R, 4) px. centre (R, K, 2) px, inverse (R, K, 3): of the parts.
    distance (R,): occlusion order, nearest lowest. pos (R, 2) m: feet. unproject (3, 3): `raycast.unprojection`.
    solids: None without walls and pillars that can hide somebody. stairs: stairs and boxes alone; None without them.
    things: Hiders; None without things.
    """
    # numba leaves out the branches of solids, stairs and things if they are None: half of what there is to compile.
    rows = len(box)
    seen, cut, part = np.empty(rows), np.empty(rows), np.empty((rows, 4))
    people = np.empty(rows, np.int64)
    if solids is not None:
        between, before = np.empty(len(solids.walls), np.int64), np.empty(len(solids.pillars), np.int64)
    if things is not None:
        near = np.empty(len(things.box), np.int64)
    o, d, hit = np.empty(3), np.empty(3), np.empty(HIT_SLOTS)
    for f in range(len(starts) - 1):
        for i in range(starts[f], starts[f + 1]):
            left, top, width, height = box[i, LEFT], box[i, TOP], box[i, WIDTH], box[i, HEIGHT]
            seen[i], cut[i] = 0.0, 1.0
            for k in range(4):
                part[i, k] = np.nan
            if not (width > 0 and height > 0):
                continue
            n = _nearer_people(i, starts[f], starts[f + 1], box, distance, people)
            n_walls = n_pillars = n_things = 0
            if solids is not None:
                n_walls = _walls_between(pos[i, 0], pos[i, 1], eye, solids.walls, between)
                n_pillars = _pillars_before(pos[i, 0], pos[i, 1], eye, solids.pillars, before)
            if things is not None:
                for j in range(things.first[f], things.end[f]):
                    if _overlap(box[i], things.box[j]):
                        near[n_things] = j
                        n_things += 1
            whole = left >= 0 and top >= 0 and left + width <= image_size[0] and top + height <= image_size[1]
            # Most people are wholly in view with nothing before them.
            if whole and n + n_walls + n_pillars + n_things == 0 and stairs is None:
                seen[i], cut[i] = 1.0, 0.0
                for k in range(4):  # an assignment of the row takes two seconds to compile
                    part[i, k] = box[i, k]
                continue
            total = inside = visible = 0
            all_low_c, all_high_c, all_low_r, all_high_r = COLUMNS, -1, ROWS, -1
            low_c, high_c, low_r, high_r = COLUMNS, -1, ROWS, -1
            for r in range(ROWS):
                v = top + (r + 0.5) * height / ROWS
                for c in range(COLUMNS):
                    u = left + (c + 0.5) * width / COLUMNS
                    if not _inside(centre, inverse, i, u, v):
                        continue
                    total += 1
                    all_low_c, all_high_c = min(all_low_c, c), max(all_high_c, c)
                    all_low_r, all_high_r = min(all_low_r, r), max(all_high_r, r)
                    if not (0 <= u < image_size[0] and 0 <= v < image_size[1]):
                        continue
                    inside += 1
                    hidden = False
                    for k in range(n):
                        if _inside(centre, inverse, people[k], u, v):
                            hidden = True
                            break
                    if solids is not None and not hidden and n_walls + n_pillars > 0:
                        at_pixel(unproject, u, v, d)
                        hidden = _meets_any(d, eye, between, n_walls, before, n_pillars, solids, hit)
                    if things is not None and not hidden and n_things > 0:
                        hidden = _behind_a_thing(i, u, v, near, n_things, things, o, d)
                    if stairs is not None:
                        at_pixel(unproject, u, v, d)
                        dx, dy = pos[i, 0] - eye[0], pos[i, 1] - eye[1]
                        towards = d[0] * dx + d[1] * dy
                        # They hide before the upright plane through the person that faces the eye.
                        if not hidden and towards > 0.0:
                            hidden = first_hit(eye, d, stairs, hit) < (dx * dx + dy * dy) / towards
                    if not hidden:
                        visible += 1
                        low_c, high_c = min(low_c, c), max(high_c, c)
                        low_r, high_r = min(low_r, r), max(high_r, r)
            if total == 0:
                continue
            seen[i], cut[i] = visible / total, 1 - inside / total
            if visible:
                part[i, LEFT], part[i, WIDTH] = visible_span(
                    left, width, COLUMNS, low_c, high_c, all_low_c, all_high_c, image_size[0]
                )
                part[i, TOP], part[i, HEIGHT] = visible_span(
                    top, height, ROWS, low_r, high_r, all_low_r, all_high_r, image_size[1]
                )
    return seen, cut, part
