"""Compiled loops of sim.scene.visibility: which samples of a silhouette are hidden. The numpy twin is in the tests."""

from __future__ import annotations

import numpy as np
from numba import njit

from sim.scene.raycast_kernels import nearest

COLUMNS, ROWS = 16, 32  # cells laid over each amodal box


@njit(cache=True)
def _inside(centre, inverse, i, u, v):  # type: ignore[no-untyped-def]
    """Whether (u, v) lies in body or head of row i: (u - m)ᵀ E⁻¹ (u - m) <= 1, E⁻¹ packed as a, b, d."""
    for k in range(2):
        x, y = u - centre[i, k, 0], v - centre[i, k, 1]
        if x * x * inverse[i, k, 0] + 2 * x * y * inverse[i, k, 1] + y * y * inverse[i, k, 2] <= 1.0:
            return True
    return False


@njit(cache=True)
def _nearer(i, first, last, box, distance, found):  # type: ignore[no-untyped-def]
    """Rows of the same frame that are nearer than i and whose boxes overlap i's, into `found`; their number."""
    n = 0
    for j in range(first, last):
        if distance[j] > distance[i] or (distance[j] == distance[i] and j >= i):
            continue
        if (
            box[j, 0] < box[i, 0] + box[i, 2]
            and box[i, 0] < box[j, 0] + box[j, 2]
            and box[j, 1] < box[i, 1] + box[i, 3]
            and box[i, 1] < box[j, 1] + box[j, 3]
        ):
            found[n] = j
            n += 1
    return n


@njit(cache=True)
def _walls_between(x, y, eye, walls, found):  # type: ignore[no-untyped-def]
    """Walls with the person at (x, y) and the eye on different sides of their line, into `found`; their number."""
    n = 0
    for w in range(len(walls)):
        ax, ay = walls[w, 0, 0], walls[w, 0, 1]
        ex, ey = walls[w, 1, 0] - ax, walls[w, 1, 1] - ay
        if (ex * (y - ay) - ey * (x - ax)) * (ex * (eye[1] - ay) - ey * (eye[0] - ax)) < 0:
            found[n] = w
            n += 1
    return n


@njit(cache=True)
def _pillars_before(x, y, eye, pillars, found):  # type: ignore[no-untyped-def]
    """Pillars nearer to the eye than the person: those whose tangent from the eye is shorter than the way to (x, y)."""
    n = 0
    dx, dy = x - eye[0], y - eye[1]
    for p in range(len(pillars)):
        px, py = pillars[p, 0] - eye[0], pillars[p, 1] - eye[1]
        if dx * dx + dy * dy > px * px + py * py - pillars[p, 2] ** 2 and px * dx + py * dy > 0:
            found[n] = p
            n += 1
    return n


@njit(cache=True)
def _wall_hit(d, eye, wall, height):  # type: ignore[no-untyped-def]
    """Whether the ray eye + s d, s > 0, meets the upright rectangle over `wall` from z = 0 to `height`."""
    ex, ey = wall[1, 0] - wall[0, 0], wall[1, 1] - wall[0, 1]
    ax, ay = wall[0, 0] - eye[0], wall[0, 1] - eye[1]
    cross = d[0] * ey - d[1] * ex
    if cross == 0.0:
        return False
    s = (ax * ey - ay * ex) / cross
    t = (ax * d[1] - ay * d[0]) / cross
    z = eye[2] + s * d[2]
    return s > 0 and 0 <= t <= 1 and 0 <= z <= height


@njit(cache=True)
def _pillar_hit(d, eye, pillar, height):  # type: ignore[no-untyped-def]
    """Whether the ray eye + s d, s > 0, meets the upright cylinder from z = 0 to `height`, its top included."""
    px, py = pillar[0] - eye[0], pillar[1] - eye[1]
    a = d[0] * d[0] + d[1] * d[1]
    b = px * d[0] + py * d[1]
    root = b * b - a * (px * px + py * py - pillar[2] ** 2)
    if root <= 0 or a == 0.0 or b <= 0:
        return False
    enter = eye[2] + max(0.0, (b - np.sqrt(root)) / a) * d[2]
    leave = eye[2] + (b + np.sqrt(root)) / a * d[2]
    return min(enter, leave) <= height and max(enter, leave) >= 0


@njit(cache=True)
def span(start, length, cells, low, high, first, last, limit):  # type: ignore[no-untyped-def]
    """Start and length of the visible cells low … high along one axis, cut at the image.

    Where the silhouette's own first or last cell is visible, its amodal edge is taken, whatever the cell's middle.
    """
    a = start + (0 if low == first else low) * length / cells
    b = start + (cells if high == last else high + 1) * length / cells
    a = max(a, 0.0)
    return a, min(b, limit) - a


@njit(cache=True)
def _meets(d, eye, walls, between, tall, pillars, before, high):  # type: ignore[no-untyped-def]
    """Whether the ray eye + s d meets one of the walls `between` or one of the pillars `before`."""
    hit = False
    for w in between:
        hit = hit or _wall_hit(d, eye, walls[w], tall)
    for p in before:
        hit = hit or _pillar_hit(d, eye, pillars[p], high)
    return hit


@njit(cache=True)
def _stairs_before(d, eye, x, y, still, hit):  # type: ignore[no-untyped-def]
    """Whether the ray eye + s d meets stairs, or ground before a flight that goes down, before the upright plane
    through (x, y) that faces the eye."""
    dx, dy = x - eye[0], y - eye[1]
    towards = d[0] * dx + d[1] * dy
    return towards > 0.0 and nearest(eye, d, still, hit) < (dx * dx + dy * dy) / towards


@njit(cache=True)
def look(starts, box, centre, inverse, distance, pos, size, has_eye, eye, unproject, walls, tall, pillars, high, still):  # type: ignore[no-untyped-def]
    """Visibility (R,), truncation (R,) and visible boxes (R, 4) of all rows; see sim.scene.visibility.look."""
    rows = len(box)
    seen, cut, part = np.zeros(rows), np.ones(rows), np.full((rows, 4), np.nan)
    people = np.empty(rows, np.int64)
    between, before = np.empty(len(walls), np.int64), np.empty(len(pillars), np.int64)
    d, hit = np.empty(3), np.empty(6)
    stairs = has_eye and len(still[4]) > 0
    for f in range(len(starts) - 1):
        for i in range(starts[f], starts[f + 1]):
            left, top, width, height = box[i, 0], box[i, 1], box[i, 2], box[i, 3]
            if not (width > 0 and height > 0):
                continue
            n = _nearer(i, starts[f], starts[f + 1], box, distance, people)
            n_walls = _walls_between(pos[i, 0], pos[i, 1], eye, walls, between) if has_eye else 0
            n_pillars = _pillars_before(pos[i, 0], pos[i, 1], eye, pillars, before) if has_eye else 0
            whole = left >= 0 and top >= 0 and left + width <= size[0] and top + height <= size[1]
            if whole and n + n_walls + n_pillars == 0 and not stairs:
                seen[i], cut[i], part[i] = 1.0, 0.0, box[i]
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
                    if not (0 <= u < size[0] and 0 <= v < size[1]):
                        continue
                    inside += 1
                    hidden = False
                    for k in range(n):
                        if _inside(centre, inverse, people[k], u, v):
                            hidden = True
                            break
                    if not hidden and (stairs or n_walls + n_pillars):
                        for k in range(3):
                            d[k] = unproject[k, 0] * u + unproject[k, 1] * v + unproject[k, 2]
                        hidden = _meets(d, eye, walls, between[:n_walls], tall, pillars, before[:n_pillars], high)
                        if not hidden and stairs:
                            hidden = _stairs_before(d, eye, pos[i, 0], pos[i, 1], still, hit)
                    if not hidden:
                        visible += 1
                        low_c, high_c = min(low_c, c), max(high_c, c)
                        low_r, high_r = min(low_r, r), max(high_r, r)
            if total == 0:
                continue
            seen[i], cut[i] = visible / total, 1 - inside / total
            if visible:
                part[i, 0], part[i, 2] = span(left, width, COLUMNS, low_c, high_c, all_low_c, all_high_c, size[0])
                part[i, 1], part[i, 3] = span(top, height, ROWS, low_r, high_r, all_low_r, all_high_r, size[1])
    return seen, cut, part
