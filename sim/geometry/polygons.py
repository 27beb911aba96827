"""Convex polygons on a plane: hulls, areas, overlaps, gaps, footprints; many at once.

A polygon is (V, 2), counter-clockwise in (x, y), not closed, no three vertices on a line; fewer than 3 vertices have no
area. `Hulls` packs N of them, so that K pairs are compared in one go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints

FOOTPRINT = 0.25  # m, radius of a person's footprint
SIDES = 16  # vertices of a footprint, on the circle
ON = 1e-9  # of a polygon's size: closer than this to an edge is on it
CHUNK = 4096  # pairs compared at once: their tables stay in the cache


@dataclass(frozen=True, slots=True, eq=False)
class Hulls:
    """N polygons: vertex (N, V, 2), the last vertex repeated where fewer; box (N, 4) min x, min y, max x, max y."""

    vertex: Array
    box: Array
    area: Array

    def __len__(self) -> int:
        return len(self.vertex)


def pack(polygons: Sequence[Array], width: int = 1) -> Hulls:
    """Polygons ready for `iou_pairs` and `gap_pairs`, at least `width` vertices each.

    One without vertices is nowhere (nan) and meets nothing.
    """
    count = np.array([len(p) for p in polygons], np.int64)
    flat = np.concatenate([*(np.asarray(p, float).reshape(-1, 2) for p in polygons), [[np.nan, np.nan]]])
    first = np.cumsum(count) - count
    width = int(count.max(initial=width))
    place = first[:, None] + np.minimum(np.arange(width), np.maximum(count - 1, 0)[:, None])
    return packed(flat[np.where(count[:, None] > 0, place, len(flat) - 1)])


def packed(vertex: Array) -> Hulls:
    """Hulls of vertices (N, V, 2) that are already padded."""
    box = np.concatenate([vertex.min(axis=1), vertex.max(axis=1)], axis=1)
    return Hulls(vertex, box, np.nan_to_num(_shoelace(vertex)))


def _shoelace(vertex: Array) -> Array:
    """Signed area (N,) of (N, V, 2); relative to the first vertex, for the numerics of places far from the origin."""
    p = vertex - vertex[:, :1]
    return np.asarray(0.5 * _cross(p, np.roll(p, -1, axis=1)).sum(axis=1))


def _cross(a: Array, b: Array) -> Array:
    product: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def area(polygon: Array) -> float:
    """Area of one polygon."""
    return float(_shoelace(np.asarray(polygon, float)[None])[0]) if len(polygon) > 2 else 0.0


def convex_hull(points: Array) -> Array:
    """(V, 2) hull of points (N, 2), counter-clockwise from the leftmost (lowest of those); Andrew's monotone chain."""
    rows = sorted(set(map(tuple, np.asarray(points, float).tolist())))
    if len(rows) < 3:
        return np.array(rows, float).reshape(-1, 2)
    lower, upper = _chain(rows), _chain(rows[::-1])
    return np.array(lower[:-1] + upper[:-1], float)


def _chain(rows: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    kept: list[tuple[float, ...]] = []
    for x, y in rows:
        while len(kept) > 1:
            (ax, ay), (bx, by) = kept[-2], kept[-1]
            if (bx - ax) * (y - ay) > (by - ay) * (x - ax):
                break
            kept.pop()
        kept.append((x, y))
    return kept


def intersection_pairs(a: Hulls, b: Hulls, i: Ints, j: Ints) -> Array:
    """Common area (K,) of polygons a[i[k]] and b[j[k]].

    The common part of two convex polygons is the hull of what each one's edges have inside the other: of a's edges
    clipped to b (Cyrus & Beck), and b's vertices inside a. These lie in convex position, so sorting by the angle round
    their middle orders them; a point counted twice or a hair outside costs a hair, which clipping edge by edge
    does not promise where edges coincide.
    """
    common = np.zeros(len(i))
    near = (a.box[i, :2] < b.box[j, 2:]).all(axis=1) & (b.box[j, :2] < a.box[i, 2:]).all(axis=1)
    possible = np.flatnonzero(near & (a.area[i] > 0) & (b.area[j] > 0))
    for low in range(0, len(possible), CHUNK):
        part = possible[low : low + CHUNK]
        common[part] = _common_area(a.vertex[i[part]], b.vertex[j[part]])
    return common


def _common_area(a: Array, b: Array) -> Array:
    """Common area (K,) of (K, V, 2) and (K, W, 2)."""
    origin = a[:, :1]
    a, b = a - origin, b - origin
    size = np.abs(np.concatenate([a, b], axis=1)).max(axis=(1, 2))
    slack = ON * size[:, None, None] ** 2
    enter, leave = _clip(a, b, slack)
    edge = np.roll(a, -1, axis=1) - a
    inside = (_sides(b, a) >= -slack).all(axis=1)
    points = np.concatenate([a + enter[..., None] * edge, a + leave[..., None] * edge, b], axis=1)
    good = np.concatenate([enter <= leave, enter <= leave, inside], axis=1)
    return _area_round_middle(points, good)


def _sides(points: Array, polygon: Array) -> Array:
    """(K, V, N): how far left of each of V edges each of N points lies, times the edge's length."""
    edge = np.roll(polygon, -1, axis=1) - polygon
    offset = _cross(polygon, edge)  # cross(e, p - a) = cross(e, p) + cross(a, e)
    return (
        edge[:, :, None, 0] * points[:, None, :, 1]
        - edge[:, :, None, 1] * points[:, None, :, 0]
        + offset[:, :, None]
    )  # fmt: skip


def _clip(a: Array, b: Array, slack: Array) -> tuple[Array, Array]:
    """From where to where (K, V), as shares of their lengths, the edges of a are inside b; from > to: nowhere."""
    start = _sides(a, b)
    change = np.roll(start, -1, axis=2) - start
    beside = np.abs(change) <= slack
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -start / change
    enter = np.where(beside, np.where(start < -slack, 2.0, 0.0), np.where(change > 0, at, 0.0)).max(axis=1)
    leave = np.where(~beside & (change < 0), at, 1.0).min(axis=1)
    return enter, leave


def _area_round_middle(points: Array, good: Bools) -> Array:
    """Area (K,) of the convex polygons whose vertices (K, N, 2) are the good ones (K, N), in any order."""
    n = good.sum(axis=1)
    middle = np.where(good[..., None], points, 0.0).sum(axis=1) / np.maximum(n, 1)[:, None]
    arm = points - middle[:, None]
    # What is not a vertex stands on the last one, where it adds no area.
    angle = np.where(good, np.arctan2(arm[..., 1], arm[..., 0]), np.inf)
    order = np.argsort(angle, axis=1)
    order = np.where(
        np.arange(order.shape[1]) < n[:, None], order, order[np.arange(len(n)), np.maximum(n - 1, 0)][:, None]
    )
    ring = np.take_along_axis(arm, order[..., None], axis=1)
    return np.where(n > 2, np.maximum(_shoelace(np.nan_to_num(ring, posinf=0.0, neginf=0.0)), 0.0), 0.0)


def iou_pairs(a: Hulls, b: Hulls, i: Ints, j: Ints) -> Array:
    """Intersection over union (K,) of a[i[k]] and b[j[k]]; 0 without area, exactly 1 for the same vertices."""
    common = intersection_pairs(a, b, i, j)
    union = a.area[i] + b.area[j] - common
    iou = np.where(common > 0, np.minimum(common / np.where(union > 0, union, 1.0), 1.0), 0.0)
    if a.vertex.shape[1] == b.vertex.shape[1]:
        iou[(a.area[i] > 0) & (a.vertex[i] == b.vertex[j]).all(axis=(1, 2))] = 1.0
    return iou


def iou_matrix(a: Sequence[Array], b: Sequence[Array]) -> Array:
    """Intersection over union (N, M) of N and M polygons."""
    i, j = (g.ravel() for g in np.indices((len(a), len(b))))
    width = max((len(p) for p in (*a, *b)), default=1)
    return iou_pairs(pack(a, width), pack(b, width), i, j).reshape(len(a), len(b))


def gap_pairs(a: Hulls, b: Hulls, i: Ints, j: Ints) -> Array:
    """Distance (K,) between polygons a[i[k]] and b[j[k]]; 0 where they overlap, nan where one has no vertices."""
    gap = np.empty(len(i))
    for low in range(0, len(i), CHUNK):
        part = slice(low, low + CHUNK)
        gap[part] = _gap(a.vertex[i[part]], b.vertex[j[part]])
    return gap


def edge_distance_pairs(a: Hulls, b: Hulls, i: Ints, j: Ints) -> Array:
    """Least distance (K,) of a vertex of either a[i[k]] or b[j[k]] to an edge of the other: their gap, unless they
    overlap. Cheaper than `gap_pairs`, and right for polygons without area, too."""
    nearest = np.empty(len(i))
    for low in range(0, len(i), CHUNK):
        part = slice(low, low + CHUNK)
        nearest[part] = _nearest(a.vertex[i[part]], b.vertex[j[part]])
    return nearest


def _nearest(a: Array, b: Array) -> Array:
    return np.minimum(_to_edges(a, b), _to_edges(b, a))


def _gap(a: Array, b: Array) -> Array:
    """Distance (K,): 0 unless an edge of one has the whole other on its outer side (separating axes)."""
    nearest = _nearest(a, b)
    apart = _beyond(b, a) | _beyond(a, b)
    return np.where(apart | np.isnan(nearest), nearest, 0.0)


def _beyond(points: Array, polygon: Array) -> Bools:
    """Whether all of the points (K, N, 2) are on the outer side of one edge of the polygon (K, V, 2)."""
    return np.asarray((_sides(points, polygon).max(axis=2) < 0).any(axis=1))


def _to_edges(points: Array, polygon: Array) -> Array:
    """Least distance (K,) from any of the points (K, N, 2) to any edge of the polygon (K, V, 2)."""
    # x and y apart: numpy sums over an axis of two slowly.
    ex, ey = (np.roll(polygon[..., k], -1, axis=1)[..., None] - polygon[..., k, None] for k in (0, 1))
    ax, ay = (points[:, None, :, k] - polygon[..., k, None] for k in (0, 1))
    length2 = ex * ex + ey * ey
    share = np.clip((ax * ex + ay * ey) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    dx, dy = ax - share * ex, ay - share * ey
    return np.asarray(np.sqrt((dx * dx + dy * dy).min(axis=(1, 2))))


def hull_gap(a: Array, b: Array) -> float:
    """Distance between two polygons; 0 where they overlap."""
    none = np.zeros(1, np.int64)
    return float(gap_pairs(pack([a]), pack([b]), none, none)[0])


def contains(polygon: Array, points: Array, dilate: float = 0.0) -> Bools:
    """Which points (N, 2) lie in the polygon or no further than `dilate` from it."""
    points = np.asarray(points, float).reshape(-1, 2)
    if not len(polygon):
        return np.zeros(len(points), bool)
    inside = (_sides(points[None], polygon[None])[0].min(axis=0) >= 0) & (len(polygon) > 2)
    if dilate <= 0:
        return np.asarray(inside)
    far = _to_edges(points[:, None], np.broadcast_to(polygon, (len(points), *polygon.shape)))
    return np.asarray(inside | (far <= dilate))
