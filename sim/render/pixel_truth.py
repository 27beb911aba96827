"""The exact truth of one frame's pixels (`types.PixelTruth`), and masks (H, W) of single people, visible or whole.

The truth is measured in an id map (H, W), which holds the id of the person that each pixel shows. It has each person's
number of visible pixels, the box round them in px, and the number of the connected region of people.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import bodies_at, outlines, packed_inverse
from sim.types import Array, Bools, Camera, Ints, Motion, PixelTruth


def pixel_truth(ids: Ints, bounds: Ints, id: Ints, amodal: Ints, disparity: Array | None) -> PixelTruth:
    """Return the PixelTruth of an id map, with visible pixels, box and connected region of each of N people, in the
    order of id.

    ids (H, W): person id where a person is visible, 0 or negative elsewhere. id (N,): of the people; every positive id
    in the map must be among them. bounds (N, 4): first row, last row + 1, first column, last column + 1 outside which
    each person is not visible. amodal (N,): pixels of the whole silhouettes in the image. disparity (H, W) px is passed
    through, None included. A person without visible pixels has count 0, a nan box (left, top, width, height in px) and
    region number -1.
    """
    from sim.render.pixel_truth_kernels import count_pixels

    count, blob, edges = np.zeros(len(id), np.int64), np.empty(len(id), np.int64), np.empty((len(id), 4), np.int64)
    row_of = np.zeros(int(id.max(initial=0)) + 1, np.int64)
    row_of[id] = np.arange(len(id))
    count_pixels(ids, bounds, id, row_of, count, edges, blob)
    low, high = edges[:, 0::2].astype(float), edges[:, 1::2].astype(float)
    box = np.where(count[:, None] > 0, np.concatenate([low, high - low], axis=1), np.nan)
    return PixelTruth(ids, disparity, count.astype(float), amodal.astype(float), box, blob)


def modal_mask(pixels: PixelTruth, person: int) -> Bools:
    """Return the mask (H, W), True at the pixels in which the person with this id (from 1 on) is visible.

    All False if the person is hidden or absent.
    """
    return np.asarray(pixels.ids == person)


def amodal_mask(motion: Motion, camera: Camera, index: int, person: int) -> Bools:
    """Return the mask (H, W), True at the pixels that would show a person if nothing hid that person in frame `index`.

    index: from 1 on. person: id, from 1 on. All False if the person is absent in that frame, or outside the image. A
    body or head that is not wholly in front of the camera is left out. Raises IndexError for a frame behind the last or
    an id above the number of people; 0 and negative numbers are not refused, but count from the end.
    """
    t, p = np.array([index - 1]), np.array([person - 1])
    width, height = camera.image
    mask = np.zeros((height, width), np.bool_)
    if not motion.present[t[0], p[0]]:
        return mask
    _, shapes = bodies_at(motion, t, p)
    ellipses = outlines(camera, shapes)
    u, v = np.arange(width) + 0.5, (np.arange(height) + 0.5)[:, None]
    for (mu, mv), (a, b, d) in zip(ellipses.centre[0], packed_inverse(ellipses.shape)[0], strict=True):
        mask |= a * (u - mu) ** 2 + 2 * b * (u - mu) * (v - mv) + d * (v - mv) ** 2 <= 1.0
    return mask
