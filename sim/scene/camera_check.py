"""Checks that a camera can see the ground of its scene: image, lens, rotation, place; one line about what is wrong.

Calibrations of users, stored cameras and cameras of scenarios pass through the same check before they are used.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, PICTURE_SIZES, SCALES, fits_picture, is_number
from sim.elementary import dot, product
from sim.scene.camera import px_per_m_at_centre, shows_ground, to_ground
from sim.types import Camera

ROTATION_TOLERANCE = 0.01  # difference of R Rᵀ from the identity: rotations are often written with three decimals
FOCAL = (0.1, 100.0)  # focal length in widths of the image: a fisheye has some 0.3, a telescope 50
ASPECT = 2.0  # greatest ratio of the two focal lengths
CENTRE = 1.0  # by how many image sizes the image centre may lie outside the image
FOLD = -1 / 3  # least radial r² at the image's corner: below it the lens would show two points at one place
BULGE = 10.0  # greatest radial r² there
DOWN = 0.99  # least downward part of the forward axis of a camera of kind "top"


def require_camera(camera: Camera, file: object = "", place: str = "") -> Camera:
    """Returns the camera unchanged if it can be used; raises InputError otherwise."""
    for key, good, got, expected in _facts(camera):
        if not good:
            where = f"{place}: {key}" if place else key
            raise InputError(file=file, place=where, got=got, expected=expected, remedy="correct the camera")
    return camera


def _facts(camera: Camera) -> Iterator[tuple[str, bool, str, str]]:
    """Yields (field, whether it is right, what was found, what was expected); each supposes that those before hold."""
    (w, h), p, r = camera.image, camera.position, camera.rotation
    yield "image", fits_picture(w, h), f"{w}×{h} px", PICTURE_SIZES
    if camera.kind == "pinhole":
        yield from _lens(camera)
    with np.errstate(over="ignore", invalid="ignore"):
        off = float(np.abs(product(r, r.T) - np.eye(3)).max())
    got = f"rows that are no unit vectors at right angles (off by {off:.2g})"
    yield "rotation", off <= ROTATION_TOLERANCE, got, "a rotation matrix, world to camera"
    turn, expected = float(dot(r[0], np.cross(r[1], r[2]))), "determinant +1: x right, y down, z forward"
    yield "rotation", turn > 0, "a mirrored rotation (determinant -1)", expected
    yield "position", bool((np.abs(p) <= COORDINATE).all()), str(p.tolist()), f"coordinates within {COORDINATE:g} m"
    yield "position", bool(p[2] > 0), f"a camera at height {p[2]:g} m", "above the ground, z = 0 (in m)"
    down = camera.kind == "pinhole" or bool(r[2, 2] <= -DOWN)
    yield "rotation", down, "a camera of kind top that does not look down", "one that looks straight down"
    scale = px_per_m_at_centre(camera)
    good = is_number(scale, *SCALES) or (camera.kind == "pinhole" and bool(np.isnan(scale)))
    yield "px_per_m", good, f"{scale:g} px per m in the image centre", f"from {SCALES[0]:g} to {SCALES[1]:g}"
    u, v = (a.ravel() for a in np.meshgrid([0.0, w / 2, w], np.linspace(h / 2, h, 5)))
    seen = shows_ground(camera, to_ground(camera, np.concatenate([np.c_[u, v], [camera.centre_px]])))
    yield "rotation", bool(seen.any()), "an image without ground in its lower half", "a camera that sees the ground"


def _lens(camera: Camera) -> Iterator[tuple[str, bool, str, str]]:
    size, focal, centre = np.array(camera.image), np.array(camera.focal_px), np.array(camera.centre_px)
    (w, h), low, high = camera.image, FOCAL[0] * size.max(), FOCAL[1] * size.max()
    got = f"focal_px {list(camera.focal_px)}, centre_px {list(camera.centre_px)} for {w}×{h}"
    alike = ((focal >= low) & (focal <= high)).all() and focal.max() <= ASPECT * focal.min()
    yield "focal_px", bool(alike), got, f"two like focal lengths from {low:g} to {high:g} px"
    near = ((centre >= -CENTRE * size) & (centre <= (1 + CENTRE) * size)).all()
    yield "centre_px", bool(near), got, "an image centre near the image"
    bend = camera.radial * float(np.square(np.maximum(np.abs(centre), np.abs(size - centre)) / focal).sum())
    got, expected = f"a lens with radial r² = {bend:.3g} at the image's corner", f"from {FOLD:.2f} to {BULGE:g} there"
    yield "radial", FOLD < bend <= BULGE, got, expected
