"""What is true of a frame's pixels (types.PixelTruth), and masks of people."""

from __future__ import annotations

import numpy as np

from sim.scene.body import ellipsoids, outlines, packed_inverse
from sim.scene.terrain import height_at
from sim.types import Array, Bools, Camera, Ints, Motion, PixelTruth


def pixel_truth(ids: Ints, boxes: Ints, id: Ints, amodal: Ints, disparity: Array | None) -> PixelTruth:
    """Who shows where in an id map (H, W): visible pixels, boxes, people who share a blob.

    boxes (N, 4): rows and columns outside which person id (N,) does not show; amodal (N,) px of whole silhouettes.
    """
    from sim.render.pixel_truth_kernels import tally

    count, blob, edges = np.zeros(len(id), np.int64), np.empty(len(id), np.int64), np.empty((len(id), 4), np.int64)
    row_of = np.zeros(int(id.max(initial=0)) + 1, np.int64)
    row_of[id] = np.arange(len(id))
    tally(ids, boxes, id, row_of, count, edges, blob)
    low, high = edges[:, 0::2].astype(float), edges[:, 1::2].astype(float)
    box = np.where(count[:, None] > 0, np.concatenate([low, high - low], axis=1), np.nan)
    return PixelTruth(ids, disparity, count.astype(float), amodal.astype(float), box, blob)


def modal_mask(pixels: PixelTruth, person: int) -> Bools:
    """(H, W): where this person shows."""
    return np.asarray(pixels.ids == person)


def amodal_mask(motion: Motion, camera: Camera, index: int, person: int) -> Bools:
    """(H, W): where this person (id) would show in frame `index` if nobody and nothing were in the way."""
    p = np.array([person - 1])
    width, height = camera.image
    mask = np.zeros((height, width), np.bool_)
    if not motion.present[index - 1, p[0]]:
        return mask
    xy = motion.pos[index - 1, p]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    shapes = ellipsoids(pos3, motion.heading[index - 1, p], motion.height[p], motion.width[p], motion.depth[p])
    ellipses = outlines(camera, shapes)
    u, v = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
    for (mu, mv), (a, b, d) in zip(ellipses.centre[0], packed_inverse(ellipses.shape)[0], strict=True):
        mask |= a * (u - mu) ** 2 + 2 * b * (u - mu) * (v - mv) + d * (v - mv) ** 2 <= 1.0
    return mask
