"""Convex polygons in the plane: hull, area, overlap (IoU), distance, point-in-polygon; many pairs at once.

A polygon is an array (V, 2) of vertices, counter-clockwise in (x, y), not closed, without three vertices on a line.
With fewer than 3 vertices it has no area. `PackedPolygons` holds N polygons in one array, so that the `*_pairs`
functions compare K pairs in one call. Lengths may have any unit; results have the same unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.elementary import atan2
from sim.types import Array, Bools, Ints

EDGE_TOLERANCE = 1e-9  # a point closer to an edge than this share of the polygons' size is on the edge
CHUNK = 4096  # pairs per pass: their arrays stay in the cache


@dataclass(frozen=True, slots=True, eq=False)
class PackedPolygons:
    """N convex polygons in arrays of equal width, for the `*_pairs` functions; len() gives N.

    vertex (N, V, 2): x, y, in any unit; the last vertex of each polygon is repeated up to V. box (N, 4): min x, min y,
    max x, max y. Both are nan for a polygon without vertices. area (N,): signed, negative if the vertices are
    clockwise, 0 without vertices or with a nan.
    """

    vertex: Array
    box: Array
    area: Array

    def __len__(self) -> int:
        return len(self.vertex)


def pack(polygons: Sequence[Array], width: int = 1) -> PackedPolygons:
    """Return PackedPolygons of N polygons (V, 2), each padded to the most vertices of any, to at least `width` and 1.

    A polygon without vertices becomes nan: it overlaps nothing, and its distance to anything is nan. N may be 0."""
    count = np.array([len(p) for p in polygons], np.int64)
    flat = np.concatenate([*(np.asarray(p, float).reshape(-1, 2) for p in polygons), [[np.nan, np.nan]]])
    first = np.cumsum(count) - count
    width = max(1, int(count.max(initial=width)))
    place = first[:, None] + np.minimum(np.arange(width), np.maximum(count - 1, 0)[:, None])
    return pack_padded(flat[np.where(count[:, None] > 0, place, len(flat) - 1)])


def pack_padded(vertex: Array) -> PackedPolygons:
    """Return PackedPolygons of vertices (N, V, 2) padded by repeating the last of each; ValueError if V is 0. A polygon
    with a nan vertex has a nan box and area 0."""
    box = np.concatenate([vertex.min(axis=1), vertex.max(axis=1)], axis=1)
    return PackedPolygons(vertex, box, np.nan_to_num(_shoelace(vertex)))


def _shoelace(vertex: Array) -> Array:
    """Return the signed area (N,) of polygons with vertices (N, V, 2): positive if counter-clockwise, nan with a nan
    vertex.

    It is computed relative to the first vertex, so that it is exact far from the origin, too.
    """
    p = vertex - vertex[:, :1]
    return np.asarray(0.5 * _cross(p, np.roll(p, -1, axis=1)).sum(axis=1))


def _cross(a: Array, b: Array) -> Array:
    product: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def area(polygon: Array) -> float:
    """Return the signed area of one polygon (V, 2): negative if clockwise, 0 with fewer than 3 vertices, nan with a
    nan."""
    return float(_shoelace(np.asarray(polygon, float)[None])[0]) if len(polygon) > 2 else 0.0


def convex_hull(points: Array) -> Array:
    """Return the convex hull (V, 2) of points (N, 2), counter-clockwise, by Andrew's monotone chain.

    The first vertex is the leftmost point, the lowest of several. Repeated points and points on an edge are dropped:
    points on one line give its two ends, one point gives itself, no points give (0, 2). With a nan the result has no
    meaning.
    """
    rows = sorted(set(map(tuple, np.asarray(points, float).tolist())))
    if len(rows) < 3:
        return np.array(rows, float).reshape(-1, 2)
    lower, upper = _chain(rows), _chain(rows[::-1])
    return np.array(lower[:-1] + upper[:-1], float)


def _chain(rows: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    """Return the lower half of the convex hull of points (x, y) sorted by x, then y, with its first and last point.

    Points on the line between two others are dropped. Points sorted the other way round give the upper half. There must
    be no equal points."""
    kept: list[tuple[float, ...]] = []
    for x, y in rows:
        while len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if (bx - ax) * (y - ay) > (by - ay) * (x - ax):
                break
            kept.pop()
        kept.append((x, y))
    return kept


def intersection_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Return the area (K,) that polygons a[i[k]] and b[j[k]] have in common; 0 if either is empty, clockwise or has no
    area.

    i, j (K,): rows of a and of b, from 0 on; IndexError if one does not exist. Both polygons must be convex. The common
    part is the convex hull of the ends of a's edges clipped to b (Cyrus & Beck) and of the vertices of b inside a.
    Sorting these points by angle round their mean orders them. A point counted twice, or off by a rounding error,
    changes the area by a rounding error; clipping edge by edge does not promise that where edges coincide."""
    common = np.zeros(len(i))
    near = (a.box[i, :2] < b.box[j, 2:]).all(axis=1) & (b.box[j, :2] < a.box[i, 2:]).all(axis=1)
    possible = np.flatnonzero(near & (a.area[i] > 0) & (b.area[j] > 0))
    for low in range(0, len(possible), CHUNK):
        part = possible[low : low + CHUNK]
        common[part] = _common_area(a.vertex[i[part]], b.vertex[j[part]])
    return common


def _common_area(a: Array, b: Array) -> Array:
    """Return the common area (K,) of convex polygons a (K, V, 2) and b (K, W, 2), pair by pair; 0 if they are apart.

    Both must be counter-clockwise and have area. Points closer to an edge than 1e-9 of the polygons' size count as on
    it."""
    origin = a[:, :1]
    a, b = a - origin, b - origin
    size = np.abs(np.concatenate([a, b], axis=1)).max(axis=(1, 2))
    slack = EDGE_TOLERANCE * (size * size)[:, None, None]
    enter, leave = _clip(a, b, slack)
    edge = np.roll(a, -1, axis=1) - a
    inside = (_left_of_edges(b, a) >= -slack).all(axis=1)
    points = np.concatenate([a + enter[..., None] * edge, a + leave[..., None] * edge, b], axis=1)
    valid = np.concatenate([enter <= leave, enter <= leave, inside], axis=1)
    return _area_by_angle(points, valid)


def _left_of_edges(points: Array, polygon: Array) -> Array:
    """Return (K, V, N): distance of each of N points to the left of each of V edges, times the edge's length.

    points (K, N, 2), polygon (K, V, 2): edge v leads from vertex v to the next. Negative to the right of an edge.
    """
    edge = np.roll(polygon, -1, axis=1) - polygon
    offset = _cross(polygon, edge)  # cross(e, p - a) = cross(e, p) + cross(a, e)
    return (
        edge[:, :, None, 0] * points[:, None, :, 1]
        - edge[:, :, None, 1] * points[:, None, :, 0]
        + offset[:, :, None]
    )  # fmt: skip


def _clip(a: Array, b: Array, slack: Array) -> tuple[Array, Array]:
    """Return where each edge of a (K, V, 2) enters and leaves b (K, W, 2), two arrays (K, V), as shares of the edge's
    length.

    0 is an edge's first vertex, 1 its second; enter is at least 0, leave at most 1. Polygons are counter-clockwise.
    slack (K, 1, 1): of edge length times distance, within which a point is on an edge. enter > leave: none inside b.
    """
    start = _left_of_edges(a, b)
    change = np.roll(start, -1, axis=2) - start
    parallel = np.abs(change) <= slack
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -start / change
    enter = np.where(parallel, np.where(start < -slack, 2.0, 0.0), np.where(change > 0, at, 0.0)).max(axis=1)
    leave = np.where(~parallel & (change < 0), at, 1.0).min(axis=1)
    return enter, leave


def _area_by_angle(points: Array, valid: Bools) -> Array:
    """Return the area (K,) of convex polygons, each with the vertices of points (K, N, 2) where valid (K, N), in any
    order.

    0 with fewer than three valid points."""
    n = valid.sum(axis=1)
    middle = np.where(valid[..., None], points, 0.0).sum(axis=1) / np.maximum(n, 1)[:, None]
    arm = points - middle[:, None]
    # Invalid points are moved onto the last vertex, where they add no area.
    angle = np.where(valid, atan2(arm[..., 1], arm[..., 0]), np.inf)
    order = np.argsort(angle, axis=1, kind="stable")
    order = np.where(
        np.arange(order.shape[1]) < n[:, None], order, order[np.arange(len(n)), np.maximum(n - 1, 0)][:, None]
    )
    ring = np.take_along_axis(arm, order[..., None], axis=1)
    return np.where(n > 2, np.maximum(_shoelace(np.nan_to_num(ring, posinf=0.0, neginf=0.0)), 0.0), 0.0)


def iou_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Return the intersection over union (K,), 0 to 1, of a[i[k]] and b[j[k]]; 0 if either is empty, clockwise or has
    no area.

    i, j (K,): rows of a and of b, from 0 on; IndexError if one does not exist. Polygons with equal vertices, packed to
    equal width, give exactly 1.
    """
    common = intersection_pairs(a, b, i, j)
    union = a.area[i] + b.area[j] - common
    iou = np.where(common > 0, np.minimum(common / np.where(union > 0, union, 1.0), 1.0), 0.0)
    if a.vertex.shape[1] == b.vertex.shape[1]:
        iou[(a.area[i] > 0) & (a.vertex[i] == b.vertex[j]).all(axis=(1, 2))] = 1.0
    return iou


def iou_matrix(a: Sequence[Array], b: Sequence[Array]) -> Array:
    """Return the intersection over union (N, M), 0 to 1, of each of N polygons in a with each of M polygons in b.

    A polygon is an array (V, 2), convex and counter-clockwise. The value is 0 if either is empty, clockwise or has no
    area, and exactly 1 for equal polygons. N or M may be 0."""
    i, j = (g.ravel() for g in np.indices((len(a), len(b))))
    width = max((len(p) for p in (*a, *b)), default=1)
    return iou_pairs(pack(a, width), pack(b, width), i, j).reshape(len(a), len(b))


def gap_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Return the distance (K,) between convex polygons a[i[k]] and b[j[k]]: 0 where they overlap or touch; nan for an
    empty one.

    i, j (K,): rows of a and of b, from 0 on; IndexError if one does not exist. Both must be counter-clockwise. At least
    one polygon of a pair must have area: two without may get 0 although they are apart. For them use
    `edge_distance_pairs`."""
    gap = np.empty(len(i))
    for low in range(0, len(i), CHUNK):
        part = slice(low, low + CHUNK)
        gap[part] = _gap(a.vertex[i[part]], b.vertex[j[part]])
    return gap


def edge_distance_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Return the least distance (K,) from a vertex of either polygon, a[i[k]] or b[j[k]], to an edge of the other.

    i, j (K,): rows of a and of b, from 0 on; IndexError if one does not exist. It is the distance between the polygons
    unless they overlap; then it may be above 0. nan where one has no vertices. It is cheaper than `gap_pairs`, and
    polygons need no area: one vertex is a point, two are a segment.
    """
    least = np.empty(len(i))
    for low in range(0, len(i), CHUNK):
        part = slice(low, low + CHUNK)
        least[part] = _edge_distance(a.vertex[i[part]], b.vertex[j[part]])
    return least


def _edge_distance(a: Array, b: Array) -> Array:
    return np.minimum(_distance_to_edges(a, b), _distance_to_edges(b, a))


def _gap(a: Array, b: Array) -> Array:
    """Return the distance (K,) between polygons a (K, V, 2) and b (K, W, 2), of which one has area; nan with a nan
    vertex.

    It is 0 unless an edge of one polygon has the whole other one on its outer side (separating axes).
    """
    least = _edge_distance(a, b)
    apart = _outside_an_edge(b, a) | _outside_an_edge(a, b)
    return np.where(apart | np.isnan(least), least, 0.0)


def _outside_an_edge(points: Array, polygon: Array) -> Bools:
    """Return True (K,) where all points (K, N, 2) are on the outer side of one edge of the counter-clockwise polygon
    (K, V, 2)."""
    return np.asarray((_left_of_edges(points, polygon).max(axis=2) < 0).any(axis=1))


def _distance_to_edges(points: Array, polygon: Array) -> Array:
    """Return the least distance (K,) from any of the points (K, N, 2) to any edge of the polygon (K, V, 2); nan with a
    nan."""
    # x and y apart: numpy sums over an axis of length two slowly.
    ex, ey = (np.roll(polygon[..., k], -1, axis=1)[..., None] - polygon[..., k, None] for k in (0, 1))
    ax, ay = (points[:, None, :, k] - polygon[..., k, None] for k in (0, 1))
    length2 = ex * ex + ey * ey
    share = np.clip((ax * ex + ay * ey) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    dx, dy = ax - share * ex, ay - share * ey
    return np.asarray(np.sqrt((dx * dx + dy * dy).min(axis=(1, 2))))


def polygon_gap(a: Array, b: Array) -> float:
    """Return the distance between convex, counter-clockwise polygons (V, 2) and (W, 2): 0 where they overlap or touch;
    nan if one is empty.

    At least one of them must have area: two without may get 0 although they are apart."""
    none = np.zeros(1, np.int64)
    return float(gap_pairs(pack([a]), pack([b]), none, none)[0])


def contains(polygon: Array, points: Array, dilate: float = 0.0) -> Bools:
    """Return True (N,) for the points (N, 2) in the convex polygon (V, 2), on its edge, or at most `dilate` away from
    it.

    False for a nan point. A polygon without vertices contains nothing. One that is clockwise, or has one or two
    vertices, contains only points at most `dilate` from an edge or vertex, and nothing if `dilate` is 0 or less."""
    points = np.asarray(points, float).reshape(-1, 2)
    if not len(polygon):
        return np.zeros(len(points), bool)
    inside = (_left_of_edges(points[None], polygon[None])[0].min(axis=0) >= 0) & (len(polygon) > 2)
    if dilate <= 0:
        return np.asarray(inside)
    far = _distance_to_edges(points[:, None], np.broadcast_to(polygon, (len(points), *polygon.shape)))
    return np.asarray(inside | (far <= dilate))
