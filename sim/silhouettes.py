"""Where people and their shadows can be in the image, and who shows where: counts, boxes and shared regions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.camera import project
from sim.people import Ellipsoids, outline_boxes, outlines
from sim.types import Array, Camera, Ints, PixelTruth
from sim.visibility import packed_inverse


def pixel_boxes(camera: Camera, people: Ellipsoids) -> Ints:
    """(N, 4) first column, last + 1, first row, last + 1 of who can show; empty where out of the image or behind."""
    box = outline_boxes(outlines(camera, people))
    return _clipped(box[:, :2], box[:, :2] + box[:, 2:], camera)


def _clipped(low: Array, high: Array, camera: Camera) -> Ints:
    size = np.array(camera.image, dtype=float)
    low, high = np.clip(np.nan_to_num(low), 0, size), np.clip(np.nan_to_num(high), 0, size)
    return np.stack([np.floor(low[:, 0]), np.ceil(high[:, 0]), np.floor(low[:, 1]), np.ceil(high[:, 1])], 1).astype(int)


def shadow_shapes(people: Ellipsoids, sun: Array) -> tuple[Array, Array]:
    """Inverse shapes (N, 2, 3), packed, and mean radii (N, 2) of the shadows on level ground of body and head."""
    along = np.eye(3)[:2] - np.outer(sun[:2] / sun[2], [0.0, 0.0, 1.0])
    shape = along @ people.shape @ along.T
    return packed_inverse(shape), np.linalg.det(shape) ** 0.25


def shadow_boxes(camera: Camera, people: Ellipsoids, foot: Array, height: Array, sun: Array) -> Ints:
    """(N, 4) as pixel_boxes: where shadows can be, on level ground and on walls up to the person's own height."""
    if not len(foot):
        return np.zeros((0, 4), np.int64)
    along = np.eye(3)[:2] - np.outer(sun[:2] / sun[2], [0.0, 0.0, 1.0])
    half = 1.2 * np.sqrt(np.diagonal(along @ people.shape @ along.T, axis1=2, axis2=3)) + 0.1  # (N, 2, 2) m
    corners = []
    for z in (foot, foot + height):
        middle = people.centre[..., :2] - sun[:2] / sun[2] * (people.centre[..., 2] - z[:, None])[..., None]
        for sx in (-1, 1):
            for sy in (-1, 1):
                at = middle + half * (sx, sy)
                corners.append(np.concatenate([at, np.broadcast_to(z[:, None, None], (*at.shape[:2], 1))], axis=2))
    points = np.stack(corners, axis=1).reshape(-1, 3)
    uv = project(camera, points)[0].reshape(len(foot), -1, 2)
    behind = np.isnan(uv.sum(axis=(1, 2)))
    low = np.where(behind[:, None], 0.0, np.nan_to_num(uv).min(axis=1))
    high = np.where(behind[:, None], np.array(camera.image, dtype=float), np.nan_to_num(uv).max(axis=1))
    return _clipped(low, high, camera)


def pixel_truth(ids: NDArray[np.int32], id: Ints, amodal: Ints, disparity: Array | None) -> PixelTruth:
    """Who shows where in an id map: visible pixels, boxes, connected regions."""
    from sim.paint_kernels import seen_boxes

    count, edges = np.zeros(len(id), np.int64), np.empty((len(id), 4), np.int64)
    row_of = np.full(int(id.max(initial=0)) + 1, -1)
    row_of[id] = np.arange(len(id))
    seen_boxes(ids, row_of, count, edges)
    low, high = edges[:, 0::2].astype(float), edges[:, 1::2].astype(float)
    box = np.where(count[:, None] > 0, np.concatenate([low, high - low], axis=1), np.nan)
    return PixelTruth(
        ids.astype(np.int64), disparity, count.astype(float), amodal.astype(float), box, _regions(ids, row_of, len(id))
    )


def _regions(ids: NDArray[np.int32], row_of: Ints, people: int) -> Ints:
    """(N,) number of the region that each person shows in, -1 hidden; who shows in several joins them."""
    import cv2
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    if not people:
        return np.zeros(0, np.int64)
    regions, label = cv2.connectedComponents((ids > 0).astype(np.uint8), connectivity=8)
    shows = ids > 0
    pairs = np.unique(row_of[ids[shows]] * regions + label[shows])
    row, region = pairs // regions, pairs % regions
    graph = coo_array((np.ones(len(pairs)), (row, people + region)), shape=(people + regions,) * 2)
    joined = connected_components(graph, directed=False)[1][:people]
    hidden = ~np.isin(np.arange(people), row)
    _, number = np.unique(np.where(hidden, -1, joined), return_inverse=True)
    return np.asarray(np.where(hidden, -1, number - hidden.any()), np.int64)
