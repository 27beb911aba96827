"""Compiled measures and overlaps of the groups' hulls. Exact versions: sim.geometry.polygons and tracking.scoring.

Polygons follow each other in vertex (V, 2), counter-clockwise where y is up, also in px. Polygon g is vertex[ends[g -
1] : ends[g]]; polygon 0 begins at row 0.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit


@njit(cache=True)
def _turn(a, b, c):  # type: ignore[no-untyped-def]
    """Returns twice the signed area of the triangle of points a, b, c (2,): above 0 for a left turn (y up), 0 on a
    line."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@njit(cache=True)
def measure(vertex, ends, slack):  # type: ignore[no-untyped-def]
    """Returns three arrays of G polygons: signed area (G,); box (G, 4): min x, min y, max x, max y; regular (G,) bool.

    Polygon g is vertex[ends[g - 1] : ends[g]] (polygon 0 begins at 0); vertex (V, 2), ends (G,). The area is positive
    if the polygon is counter-clockwise (y up). regular: the area is positive and no turn is to the right by more than
    `slack` times the squared size (width + height) of the vertices up to it. Without vertices the area is 0, the box
    nan and regular False.
    """
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
    """Returns indices i (K,), j (K,) of the pairs of polygons of sides a and b, of one frame, whose IoU may reach
    `least`.

    frame_a (G,), frame_b (H,): frame numbers, sorted. box_a (G, 4), box_b (H, 4): min x, min y, max x, max y. area_a,
    area_b: areas. The common area is bounded by the smaller polygon and by the overlap of the boxes. A polygon without
    area or box is in no pair. Pairs are sorted by i, then j.
    """
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
    """Returns the IoU (K,) of the convex polygons i[k] of side a and j[k] of side b, by Sutherland-Hodgman clipping.

    vertex_a (V, 2), ends_a (G,): polygon g of a is vertex_a[ends_a[g - 1] : ends_a[g]] (polygon 0 begins at 0),
    counter-clockwise; vertex_b (W, 2), ends_b (H,): side b likewise. area_a (G,), area_b (H,): their areas. i, j (K,):
    indices of polygons. 0 if the polygons share no area.
    """
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
    """Returns the greatest number of vertices of a polygon, 0 without polygons; ends (G,): index at which each polygon
    ends.
    """
    most, first = 0, 0
    for end in ends:
        most = max(most, end - first)
        first = end
    return most


@njit(cache=True)
def _cut(polygon, n, a, b, spare):  # type: ignore[no-untyped-def]
    """Clips the polygon of the first n rows to the left of the line from a to b; returns the new number of vertices.

    Left is meant with y up. Changes polygon (N, 2) in place: its first rows become the clipped polygon. A cut can add a
    vertex to a convex polygon, so both arrays need room for n + 1 rows. a, b (2,): points. spare (N, 2): work space. n
    is returned if nothing is cut off, 0 if everything is.
    """
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
    """Returns how many people of the frame are inside each of G polygons or within `reach` of it, (G,), counted up to
    2.

    -1: unsure, because the polygon is not regular (convex with positive area), or because the distance of a person,
    before two were counted, is within `slack` of `reach`. A polygon without vertices has 0.

    frame (G,), vertex (V, 2), ends (G,), box (G, 4: min x, min y, max x, max y), regular (G,): of the polygons; polygon
    g is vertex[ends[g - 1] : ends[g]]. people (R,): frame number of each position x, y in place (R, 2). frame and
    people are sorted. reach, slack: in the unit of the polygons.
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
    """Returns the distance of the point (x, y) from a convex polygon p (V, 2), V at least 1, counter-clockwise (y up);
    0 inside or on its edge."""
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
