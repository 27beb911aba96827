"""Convex polygons in the plane: hull, overlap (IoU), distance; many pairs at once.

A polygon is an array (V, 2) of vertices, counter-clockwise in (x, y), not closed, without three vertices on a line.
With fewer than 3 vertices it has no area. `PackedPolygons` holds N polygons in one array, so that the `*_pairs`
functions compare K pairs in one call. Lengths may have any unit; results have the same unit.

Hulls of footprints: the ground that groups of people cover, for all groups of a sequence at once.

The footprint of a person is FOOTPRINT, a regular 16-gon on a circle of 0.25 m. The hull of a group is the convex hull
of its members' footprints. It equals the Minkowski sum of the 16-gon Q and the hull P of the members' positions. Let
p_i be a vertex of P and q_k one of Q. p_i + q_k is a vertex of the sum where their normal cones (directions in which
each is the furthest point) share an angle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.elementary import atan2, dot, unit
from sim.types import Array, Bools, Ints

EDGE_TOLERANCE = 1e-9  # a point closer to an edge than this share of the polygons' size is on the edge
CHUNK = 4096  # pairs per pass: their arrays stay in the cache


@dataclass(frozen=True, slots=True, eq=False)
class PackedPolygons:
    """N convex polygons in arrays of equal width, for the `*_pairs` functions; len() gives N."""

    vertex: Array  # (N, V, 2) x, y, in any unit; the last vertex of each polygon is repeated up to V
    box: Array  # (N, 4) min x, min y, max x, max y. Both are nan for a polygon without vertices.
    area: Array  # (N,) signed, negative if the vertices are clockwise, 0 without vertices or with a nan

    def __len__(self) -> int:
        return len(self.vertex)


def pack(polygons: Sequence[Array], width: int = 1) -> PackedPolygons:
    """Returns N polygons, (V, 2) each with its own V, in arrays of equal width, the greatest V but at least `width`.

    The vertices of a polygon with V = 0 become nan.
    """
    count = np.array([len(p) for p in polygons], np.int64)
    flat = np.concatenate([*(np.asarray(p, float).reshape(-1, 2) for p in polygons), [[np.nan, np.nan]]])
    first = np.cumsum(count) - count
    width = max(1, int(count.max(initial=width)))
    place = first[:, None] + np.minimum(np.arange(width), np.maximum(count - 1, 0)[:, None])
    return pack_padded(flat[np.where(count[:, None] > 0, place, len(flat) - 1)])


def pack_padded(vertex: Array) -> PackedPolygons:
    """Returns the PackedPolygons of vertices (N, V, 2), where shorter polygons repeat their last vertex up to V."""
    box = np.concatenate([vertex.min(axis=1), vertex.max(axis=1)], axis=1)
    return PackedPolygons(vertex, box, np.nan_to_num(_shoelace(vertex)))


def _shoelace(vertex: Array) -> Array:
    """Returns the signed area (N,), relative to the first vertex, so that it is exact far from the origin, too."""
    p = vertex - vertex[:, :1]
    return np.asarray(0.5 * cross(p, np.roll(p, -1, axis=1)).sum(axis=1))


def cross(a: Array, b: Array) -> Array:
    """Returns the cross products a_x b_y - a_y b_x, (…), of vectors a and b, (…, 2)."""
    product: Array = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def intersection_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Returns the area (K,) that convex polygons a[i[k]] and b[j[k]] have in common; 0 if either has no area."""
    common = np.zeros(len(i))
    near = (a.box[i, :2] < b.box[j, 2:]).all(axis=1) & (b.box[j, :2] < a.box[i, 2:]).all(axis=1)
    possible = np.flatnonzero(near & (a.area[i] > 0) & (b.area[j] > 0))
    common[possible] = _in_chunks(_common_area, a, b, i[possible], j[possible])
    return common


def _in_chunks(
    measure: Callable[[Array, Array], Array], a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints
) -> Array:
    measured = np.empty(len(i))
    for low in range(0, len(i), CHUNK):
        part = slice(low, low + CHUNK)
        measured[part] = measure(a.vertex[i[part]], b.vertex[j[part]])
    return measured


def _common_area(a: Array, b: Array) -> Array:
    origin = a[:, :1]
    a, b = a - origin, b - origin
    size = np.abs(np.concatenate([a, b], axis=1)).max(axis=(1, 2))
    slack = EDGE_TOLERANCE * (size * size)[:, None, None]
    enter, leave = _clip(a, b, slack)
    edge = np.roll(a, -1, axis=1) - a
    inside = (_left_of_edges(b, a) >= -slack).all(axis=1)
    # The common part is the hull of the ends of a's edges clipped to b (Cyrus & Beck) and of the vertices of b inside
    # a. Sorted by angle, a point counted twice or off by a rounding error changes the area by a rounding error;
    # clipping edge by edge does not promise that where edges coincide.
    points = np.concatenate([a + enter[..., None] * edge, a + leave[..., None] * edge, b], axis=1)
    valid = np.concatenate([enter <= leave, enter <= leave, inside], axis=1)
    return _area_by_angle(points, valid)


def _left_of_edges(points: Array, polygon: Array) -> Array:
    """Returns the distance (K, V, N) of N points to the left of V edges, times the edge's length."""
    edge = np.roll(polygon, -1, axis=1) - polygon
    offset = cross(polygon, edge)  # cross(e, p - a) = cross(e, p) + cross(a, e)
    return (
        edge[:, :, None, 0] * points[:, None, :, 1]
        - edge[:, :, None, 1] * points[:, None, :, 0]
        + offset[:, :, None]
    )  # fmt: skip


def _clip(a: Array, b: Array, slack: Array) -> tuple[Array, Array]:
    """Returns where each edge of a enters and leaves b, (K, V) each, as shares of it; enter > leave: none inside b."""
    start = _left_of_edges(a, b)
    change = np.roll(start, -1, axis=2) - start
    parallel = np.abs(change) <= slack
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -start / change
    enter = np.where(parallel, np.where(start < -slack, 2.0, 0.0), np.where(change > 0, at, 0.0)).max(axis=1)
    leave = np.where(~parallel & (change < 0), at, 1.0).min(axis=1)
    return enter, leave


def _area_by_angle(points: Array, valid: Bools) -> Array:
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
    """Returns the intersection over union (K,) of convex polygons a[i[k]] and b[j[k]]; 0 if one of the two has no area.

    It is exactly 1 for equal polygons if a and b are packed in the same width.
    """
    common = intersection_pairs(a, b, i, j)
    union = a.area[i] + b.area[j] - common
    iou = np.where(common > 0, np.minimum(common / np.where(union > 0, union, 1.0), 1.0), 0.0)
    if a.vertex.shape[1] == b.vertex.shape[1]:
        iou[(a.area[i] > 0) & (a.vertex[i] == b.vertex[j]).all(axis=(1, 2))] = 1.0
    return iou


def gap_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Returns the distance (K,) between convex polygons a[i[k]] and b[j[k]]; 0 if they overlap.

    At least one of the two must have area. nan if one of the two has no vertices.
    """
    return _in_chunks(_gap, a, b, i, j)


def edge_distance_pairs(a: PackedPolygons, b: PackedPolygons, i: Ints, j: Ints) -> Array:
    """Returns the least distance (K,) from a vertex of a[i[k]] or b[j[k]] to an edge of the other polygon.

    This is the distance between the two polygons unless they overlap. nan if one of the two has no vertices. Polygons
    need no area. This is cheaper than `gap_pairs`.
    """
    return _in_chunks(_edge_distance, a, b, i, j)


def _edge_distance(a: Array, b: Array) -> Array:
    return np.minimum(_distance_to_edges(a, b), _distance_to_edges(b, a))


def _gap(a: Array, b: Array) -> Array:
    least = _edge_distance(a, b)
    # Separating axes: polygons are apart if one is wholly outside an edge of the other.
    apart = _outside_an_edge(b, a) | _outside_an_edge(a, b)
    return np.where(apart | np.isnan(least), least, 0.0)


def _outside_an_edge(points: Array, polygon: Array) -> Bools:
    return np.asarray((_left_of_edges(points, polygon).max(axis=2) < 0).any(axis=1))


def _distance_to_edges(points: Array, polygon: Array) -> Array:
    # x and y apart: numpy sums over an axis of length two slowly.
    ex, ey = (np.roll(polygon[..., k], -1, axis=1)[..., None] - polygon[..., k, None] for k in (0, 1))
    ax, ay = (points[:, None, :, k] - polygon[..., k, None] for k in (0, 1))
    length2 = ex * ex + ey * ey
    share = np.clip((ax * ex + ay * ey) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    dx, dy = ax - share * ex, ay - share * ey
    return np.asarray(np.sqrt((dx * dx + dy * dy).min(axis=(1, 2))))


FOOTPRINT_RADIUS = 0.25  # m
FOOTPRINT_SIDES = 16
STEP = 2 * np.pi / FOOTPRINT_SIDES  # rad: width of the normal cone of each footprint vertex
FOOTPRINT = FOOTPRINT_RADIUS * unit(STEP * np.arange(FOOTPRINT_SIDES))  # (16, 2) m, counter-clockwise
CONES = STEP * (np.arange(FOOTPRINT_SIDES) - 0.5)  # rad: the angle at which each vertex's normal cone begins
GROUPS = 512  # groups per pass
FLAT = 1e-9  # rad: a narrower cone is a rounding error, and its vertex lies on an edge


def footprint_hulls(pos: Array, count: Ints) -> list[Array]:
    """Returns the hull (V, 2) of the footprints of each group, counter-clockwise.

    pos (R, 2) m: the members of group 0, then those of group 1, …; count (G,): how many each has. No position may be
    nan. A group without members gets a hull with V = 0.
    """
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    first = np.cumsum(count) - count
    # Groups of equal size n together, up to GROUPS of them.
    for n in np.unique(count[count > 0]):
        every = np.flatnonzero(count == n)
        for low in range(0, len(every), GROUPS):
            groups = every[low : low + GROUPS]
            sums = _minkowski_sums(*_gift_wrap(pos[first[groups, None] + np.arange(n)]))
            for group, hull in zip(groups, sums, strict=True):
                hulls[group] = hull
    return hulls


def _gift_wrap(pos: Array) -> tuple[Array, Array, Array]:
    """Returns the hulls of sets pos (G, n, 2): vertices (G, V, 2), where their normal cones begin, and their widths."""
    rows, n = np.arange(len(pos)), pos.shape[1]
    # The walk begins where the cone of footprint vertex 0 does, so that no footprint cone lies across both its ends.
    now = dot(pos, unit(CONES[0])).argmax(axis=1)
    facing = np.full(len(pos), CONES[0] + np.pi / 2)  # direction of the edge that arrives at `now`
    turned = np.zeros(len(pos))
    vertex, start, width = [], [], []
    for _ in range(n + 1):  # the first vertex comes again as the last one, with the rest of its cone
        arm = pos - pos[rows, now][:, None]
        elsewhere = (arm != 0).any(axis=2)
        turn = atan2(arm[..., 1], arm[..., 0]) - facing[:, None]
        turn = (turn + np.pi / 2) % (2 * np.pi) - np.pi / 2  # a rounding error to the right is straight on
        turn = np.where(elsewhere, np.maximum(turn, 0.0), np.inf)
        least = turn.min(axis=1)
        furthest = np.where(turn <= least[:, None] + FLAT, dot(arm, arm), -1.0).argmax(axis=1)
        # The last vertex is where the turn is complete; a single position turns all the way.
        done = turned + least > 2 * np.pi - FLAT
        cone = np.where(done, 2 * np.pi - turned, least)
        vertex.append(pos[rows, now])
        start.append(facing - np.pi / 2)
        width.append(np.maximum(cone, 0.0))
        facing, turned = facing + cone, turned + cone
        now = np.where(done, now, furthest)
    return np.stack(vertex, axis=1), np.stack(start, axis=1), np.stack(width, axis=1)


def _minkowski_sums(p: Array, start: Array, width: Array) -> list[Array]:
    """Returns each hull plus the footprint: the vertices p_i + q_k whose normal cones share an angle, by angle."""
    after = (CONES - start[..., None]) % (2 * np.pi)  # (G, V, 16): angle from the start of p_i's cone to that of q_k's
    before = 2 * np.pi - after
    begins_inside = after < width[..., None]
    shared = np.where(
        begins_inside, np.minimum(STEP, width[..., None] - after), np.minimum(STEP - before, width[..., None])
    )
    turned = (start - start[:, :1])[..., None]
    key = np.where(shared > FLAT, turned + np.where(begins_inside, after, 0.0), np.inf).reshape(len(p), -1)
    corner = (p[:, :, None] + FOOTPRINT).reshape(len(p), -1, 2)
    order = np.argsort(key, axis=1, kind="stable")
    used = np.arange(key.shape[1]) < np.isfinite(key).sum(axis=1)[:, None]
    group, _ = np.nonzero(used)
    flat = corner[group, order[used]]
    ends = np.cumsum(used.sum(axis=1)).tolist()
    return [flat[a:b] for a, b in pairwise([0, *ends])]
