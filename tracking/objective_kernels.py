"""Compiled shapes of groups and their overlaps; the twins are sim.geometry.polygons, sim.geometry.footprints and
tracking.grouping.group_labels.

Polygons stand one after the other in vertex (V, 2), counter-clockwise; polygon g is vertex[ends[g - 1] : ends[g]].
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def partition(frame, column, length, people, memory, when, a, b, on):  # type: ignore[no-untyped-def]
    """(R,) of each row the least column of those it is grouped with in its frame, -1 alone:
    tracking.grouping.group_labels.label_people
    without names. Rows sorted by frame (from 0); links: when, a, b, on (L,) sorted by `when`."""
    linked = np.zeros((people, people), np.bool_)
    seen = np.full(people, -memory - 2)
    label, stack, size = np.empty(people, np.int64), np.empty(people, np.int64), np.zeros(people, np.int64)
    out = np.full(len(frame), -1)
    row, link = 0, 0
    for t in range(length):
        first = row
        while row < len(frame) and frame[row] == t:
            seen[column[row]] = t
            row += 1
        while link < len(when) and when[link] == t:
            linked[a[link], b[link]] = linked[b[link], a[link]] = on[link]
            link += 1
        label[:] = -1
        size[:] = 0
        for k in range(first, row):
            p = column[k]
            if label[p] < 0:
                _spread(p, linked, seen, t - memory, label, stack)
            size[label[p]] += 1
        for k in range(first, row):
            if size[label[column[k]]] > 1:
                out[k] = label[column[k]]
    return out


@njit(cache=True)
def _spread(p, linked, seen, since, label, stack):  # type: ignore[no-untyped-def]
    """Label everybody who is linked to p, or through others, and was seen lately, by p."""
    stack[0], n, label[p] = p, 1, p
    while n:
        n -= 1
        q = stack[n]
        for r in range(len(seen)):
            if linked[q, r] and label[r] < 0 and seen[r] >= since:
                label[r] = p
                stack[n] = r
                n += 1


@njit(cache=True)
def footprints(pos, ends, disc):  # type: ignore[no-untyped-def]
    """Hulls of groups of discs: places (R, 2) one group after the other, `disc` (S, 2) counter-clockwise from its
    lowest vertex (the leftmost of those). Edges of the places' hull and of the disc, merged by direction."""
    vertex, stop = np.empty((2 * len(pos) + len(disc) * len(ends), 2)), np.empty(len(ends), np.int64)
    n, first = 0, 0
    for g in range(len(ends)):
        hull = _hull(pos[first : ends[g]])
        i, j = 0, 0
        while i < len(hull) or j < len(disc):
            p, q = hull[i % len(hull)], disc[j % len(disc)]
            vertex[n] = p + q
            n += 1
            u, v = hull[(i + 1) % len(hull)] - p, disc[(j + 1) % len(disc)] - q
            turn = u[0] * v[1] - u[1] * v[0]
            ahead = i < len(hull) and len(hull) > 1 and (j >= len(disc) or turn >= 0)
            both = ahead and j < len(disc) and turn == 0 and u[0] * v[0] + u[1] * v[1] > 0
            if ahead:
                i += 1
            if not ahead or both:
                j += 1
            if len(hull) == 1 and j >= len(disc):
                i = 1
        first = ends[g]
        stop[g] = n
    return vertex[:n].copy(), stop


@njit(cache=True)
def _hull(points):  # type: ignore[no-untyped-def]
    """Convex hull counter-clockwise from the lowest point, the leftmost of those; points few."""
    p = points.copy()
    for i in range(1, len(p)):
        k = i
        while k > 0 and (p[k, 1] < p[k - 1, 1] or (p[k, 1] == p[k - 1, 1] and p[k, 0] < p[k - 1, 0])):
            p[k, 0], p[k - 1, 0] = p[k - 1, 0], p[k, 0]
            p[k, 1], p[k - 1, 1] = p[k - 1, 1], p[k, 1]
            k -= 1
    out, n = np.empty((2 * len(p) + 1, 2)), 0
    for i in range(len(p)):
        while n > 1 and _turn(out[n - 2], out[n - 1], p[i]) <= 0:
            n -= 1
        out[n] = p[i]
        n += 1
    base = n
    for i in range(len(p) - 2, -1, -1):
        while n > base and _turn(out[n - 2], out[n - 1], p[i]) <= 0:
            n -= 1
        out[n] = p[i]
        n += 1
    return out[: max(n - 1, 1)] if (out[0] != out[1]).any() or n < 2 else out[:1]


@njit(cache=True)
def _turn(a, b, c):  # type: ignore[no-untyped-def]
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True)
def measure(vertex, ends, slack):  # type: ignore[no-untyped-def]
    """Area (G,), box (G, 4) low, high; regular (G,): with an area, and nowhere turning right by more than `slack`."""
    area, box, regular = np.zeros(len(ends)), np.full((len(ends), 4), np.nan), np.zeros(len(ends), np.bool_)
    first = 0
    for g in range(len(ends)):
        p = vertex[first : ends[g]]
        first = ends[g]
        n, good, total = len(p), True, 0.0
        if not n:
            continue
        low_x = high_x = p[0, 0]
        low_y = high_y = p[0, 1]
        for k in range(n):
            low_x, high_x = min(low_x, p[k, 0]), max(high_x, p[k, 0])
            low_y, high_y = min(low_y, p[k, 1]), max(high_y, p[k, 1])
            total += _turn(p[0], p[k], p[(k + 1) % n]) / 2
            if not _turn(p[k], p[(k + 1) % n], p[(k + 2) % n]) >= -slack * (high_x - low_x + high_y - low_y) ** 2:
                good = False
        area[g], box[g] = total, (low_x, low_y, high_x, high_y)
        regular[g] = good and total > 0
    return area, box, regular


@njit(cache=True)
def candidates(frame_a, box_a, area_a, frame_b, box_b, area_b, least):  # type: ignore[no-untyped-def]
    """(K,), (K,) rows of the same frame whose overlap may be `least`: no more is common than the smaller of two, and
    than what their boxes share. Rows sorted by frame."""
    i, j, n = np.empty(len(frame_a) + 16, np.int64), np.empty(len(frame_a) + 16, np.int64), 0
    start = 0
    for p in range(len(frame_a)):
        while start < len(frame_b) and frame_b[start] < frame_a[p]:
            start += 1
        q = start
        while q < len(frame_b) and frame_b[q] == frame_a[p]:
            wide = min(box_a[p, 2], box_b[q, 2]) - max(box_a[p, 0], box_b[q, 0])
            high = min(box_a[p, 3], box_b[q, 3]) - max(box_a[p, 1], box_b[q, 1])
            if wide > 0 and high > 0:
                common = min(wide * high, area_a[p], area_b[q])
                if common > 0 and common >= least * (area_a[p] + area_b[q] - common):
                    if n == len(i):
                        i, j = np.append(i, i), np.append(j, j)
                    i[n], j[n] = p, q
                    n += 1
            q += 1
    return i[:n].copy(), j[:n].copy()


@njit(cache=True)
def overlaps(vertex_a, ends_a, area_a, vertex_b, ends_b, area_b, i, j):  # type: ignore[no-untyped-def]
    """(K,) intersection over union of convex polygons i of a and j of b: one is cut by each edge of the other."""
    out = np.empty(len(i))
    longest = _longest(ends_a) + _longest(ends_b) + 2
    one, two = np.empty((longest, 2)), np.empty((longest, 2))
    for k in range(len(i)):
        p = vertex_a[(ends_a[i[k] - 1] if i[k] else 0) : ends_a[i[k]]]
        q = vertex_b[(ends_b[j[k] - 1] if j[k] else 0) : ends_b[j[k]]]
        n = len(p)
        one[:n] = p
        for e in range(len(q)):
            n = _cut(one, n, q[e], q[(e + 1) % len(q)], two)
            if n < 3:
                break
        common = 0.0
        for v in range(1, n - 1):
            common += _turn(one[0], one[v], one[v + 1]) / 2
        out[k] = common / (area_a[i[k]] + area_b[j[k]] - common) if n > 2 else 0.0
    return out


@njit(cache=True)
def _longest(ends):  # type: ignore[no-untyped-def]
    most, first = 0, 0
    for end in ends:
        most = max(most, end - first)
        first = end
    return most


@njit(cache=True)
def _cut(polygon, n, a, b, spare):  # type: ignore[no-untyped-def]
    """Keep what of polygon[:n] lies left of the line from a to b; its new number of vertices."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    outside = False
    for k in range(n):
        if dx * (polygon[k, 1] - a[1]) - dy * (polygon[k, 0] - a[0]) < 0:
            outside = True
            break
    if not outside:
        return n
    m = 0
    for k in range(n):
        p, q = polygon[k], polygon[(k + 1) % n]
        s = dx * (p[1] - a[1]) - dy * (p[0] - a[0])
        t = dx * (q[1] - a[1]) - dy * (q[0] - a[0])
        if s >= 0:
            spare[m] = p
            m += 1
        if (s < 0) != (t < 0):
            share = s / (s - t)
            spare[m, 0], spare[m, 1] = p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])
            m += 1
    polygon[:m] = spare[:m]
    return m


@njit(cache=True)
def inside(frame, vertex, ends, box, regular, people, place, reach, slack):  # type: ignore[no-untyped-def]
    """How many people of its frame, 2 at most, are in each polygon or within `reach` of it (G,).

    -1 where that cannot be told: of a polygon that is not regular, and where somebody is within `slack` of `reach`.
    people: frame of each place (R, 2); both sorted by frame.
    """
    count, start = np.zeros(len(frame), np.int64), 0
    for g in range(len(frame)):
        p = vertex[(ends[g - 1] if g else 0) : ends[g]]
        while start < len(people) and people[start] < frame[g]:
            start += 1
        if len(p) and not regular[g]:
            count[g] = -1
            continue
        k = start
        while len(p) and k < len(people) and people[k] == frame[g] and 0 <= count[g] < 2:
            x, y = place[k]
            wide = reach + slack
            if box[g, 0] - wide <= x <= box[g, 2] + wide and box[g, 1] - wide <= y <= box[g, 3] + wide:
                gap = _gap(p, x, y)
                if abs(gap - reach) <= slack:
                    count[g] = -1
                elif gap < reach:
                    count[g] += 1
            k += 1
    return count


@njit(cache=True)
def _gap(p, x, y):  # type: ignore[no-untyped-def]
    """From a place to a convex polygon, 0 inside."""
    within, least = True, np.inf
    for k in range(len(p)):
        a, b = p[k], p[(k + 1) % len(p)]
        dx, dy, ex, ey = b[0] - a[0], b[1] - a[1], x - a[0], y - a[1]
        if dx * ey - dy * ex < 0:
            within = False
        length = dx * dx + dy * dy
        share = min(max((dx * ex + dy * ey) / length, 0.0), 1.0) if length > 0 else 0.0
        least = min(least, (ex - share * dx) ** 2 + (ey - share * dy) ** 2)
    return 0.0 if within else np.sqrt(least)
