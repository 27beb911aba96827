"""The exact truth of one frame's pixels: disparities of a stereo pair, and what an id map tells of each person.

The disparity of a point is u_left - u_right = f B / depth: focal length f in px, baseline B and depth in m; nan where
the right camera does not see the point. An id map (H, W) holds the id of the person that each pixel shows. From it
follow each person's number of visible pixels, the box round them in px, the number of the connected region of people
(`types.PixelTruth`), and masks (H, W) of single people, visible or whole.
"""

from __future__ import annotations

import numpy as np

from sim.render.camera_view import CameraView
from sim.render.canvas import FrameCanvas
from sim.render.people import DrawnPeople, ProjectedPeople
from sim.scene.body import bodies_at, outlines, packed_inverse
from sim.types import Array, Bools, Camera, Ints, Motion, PixelTruth


def empty_scene_disparities(left: CameraView, right: CameraView) -> Array:
    """Returns the disparities (H, W) px of the empty scene between two views, at the left view's pixels."""
    from sim.render import pixel_truth_kernels as kernels

    out = np.empty((left.height, left.width))
    kernels.empty_scene_disparities(
        left.geometry.depth, _scale(left, right), right.rays.origin, right.rays.direction, left.solids, out
    )
    return out


def frame_disparities(
    empty: Array, right: CameraView, canvas: FrameCanvas, ids: Ints, people: DrawnPeople, in_left: ProjectedPeople,
    in_right: ProjectedPeople,
) -> Array:  # fmt: skip
    """Returns the disparities (H, W) px of a frame with people, at the left view's pixels.

    empty (H, W): those of the empty scene. canvas: the left view's, with people drawn. ids (H, W): the people it shows.
    """
    from sim.render import pixel_truth_kernels as kernels

    out = empty.copy()
    kernels.add_people(
        canvas.depth, ids, in_left.outlines.bounds, people.id, right.camera.focal_px[0] * right.camera.baseline,
        in_right.start, in_right.step, in_right.outlines.middle, in_right.outlines.inverse, in_right.nearest_depth,
        right.geometry.depth, right.rays.origin, right.rays.direction, right.solids, out,
    )  # fmt: skip
    return out


def _scale(left: CameraView, right: CameraView) -> float:
    return left.camera.focal_px[0] * float(np.linalg.norm(right.camera.position - left.camera.position))


def pixel_truth(ids: Ints, bounds: Ints, id: Ints, amodal: Ints, disparity: Array | None) -> PixelTruth:
    """Returns the PixelTruth of an id map (H, W): visible pixels, box and connected region of N people.

    bounds (N, 4): outside which nobody is visible. id (N,). amodal (N,): pixels of the whole silhouettes.
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
    """Returns the mask (H, W) of the pixels in which a person is visible."""
    return np.asarray(pixels.ids == person)


def amodal_mask(motion: Motion, camera: Camera, index: int, person: int) -> Bools:
    """Returns the mask (H, W) of the pixels that would show a person if nothing hid them in frame `index` (from 1)."""
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
