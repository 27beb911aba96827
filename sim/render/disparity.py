"""Exact disparities of a stereo pair in px; nan where the right camera does not see the point.

The disparity of a point is u_left - u_right = f B / depth: focal length f in px, baseline B and depth in m.
"""

from __future__ import annotations

import numpy as np

from sim.render.camera_view import CameraView
from sim.render.canvas import FrameCanvas
from sim.render.people import DrawnPeople, ProjectedPeople
from sim.types import Array, Ints


def empty_scene_disparities(left: CameraView, right: CameraView) -> Array:
    """Returns the disparities (H, W) px of the empty scene between two views, at the left view's pixels."""
    from sim.render import disparity_kernels as kernels

    out = np.empty((left.height, left.width))
    kernels.empty_scene_disparities(
        left.geometry.depth, _scale(left, right), right.rays.origin, right.rays.direction, left.solids, out
    )
    return out


def frame_disparities(
    empty: Array,
    right: CameraView,
    canvas: FrameCanvas,
    ids: Ints,
    people: DrawnPeople,
    in_left: ProjectedPeople,
    in_right: ProjectedPeople,
) -> Array:
    """Returns the disparities (H, W) px of a frame with people, at the left view's pixels.

    empty (H, W): those of the empty scene. canvas: the left view's, with people drawn. ids (H, W): the people it shows.
    """
    from sim.render import disparity_kernels as kernels

    out = empty.copy()
    kernels.add_people(
        canvas.depth, ids, in_left.outlines.bounds, people.id, right.camera.focal_px[0] * right.camera.baseline,
        in_right.start, in_right.step, in_right.outlines.middle, in_right.outlines.inverse, in_right.nearest_depth,
        right.geometry.depth, right.rays.origin, right.rays.direction, right.solids, out,
    )  # fmt: skip
    return out


def _scale(left: CameraView, right: CameraView) -> float:
    return left.camera.focal_px[0] * float(np.linalg.norm(right.camera.position - left.camera.position))
