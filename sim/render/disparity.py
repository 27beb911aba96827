"""Exact disparities of a stereo pair, u_left - u_right = f B / depth; nan where the right camera sees no point."""

from __future__ import annotations

import numpy as np

from sim.render.camera_view import CameraView
from sim.render.canvas import FrameCanvas
from sim.render.people import DrawnPeople, ProjectedPeople
from sim.types import Array, Ints


def empty_scene_disparities(left: CameraView, right: CameraView) -> Array:
    """Return the disparities (H, W) px of the empty scene between two views; nan for sky and for points that only the
    left camera sees."""
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
    """Return the disparities (H, W) px of a frame with people; nan as in `empty_scene_disparities`.

    empty (H, W): disparities of the empty scene. canvas: the left view's, with people drawn. ids (H, W): person id
    where a person is visible in the left view. in_left, in_right: the same people as each camera sees them.
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
    """Focal length times the distance of the two cameras, px m."""
    return left.camera.focal_px[0] * float(np.linalg.norm(right.camera.position - left.camera.position))
