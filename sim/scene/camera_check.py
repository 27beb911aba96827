"""Checks that a camera can see the ground of its scene: image, lens, rotation, place; one line about what is wrong.

Calibrations of users, stored cameras and cameras of scenarios pass through the same check before they are used.
"""

from __future__ import annotations

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


def _facts(camera: Camera) -> list[tuple[str, bool, str, str]]:
    found: list[tuple[str, bool, str, str]] = []
    for check in (_image, _lens, _rotation, _position, _scale, _ground):
        fact = check(camera)
        found.append(fact)
        if not fact[1]:
            break
    return found


def _image(camera: Camera) -> tuple[str, bool, str, str]:
    w, h = camera.image
    return "image", fits_picture(w, h), f"{w}×{h} px", PICTURE_SIZES


def _lens(camera: Camera) -> tuple[str, bool, str, str]:
    if camera.kind == "top":
        return "focal_px", True, "", ""
    size, focal, centre = np.array(camera.image), np.array(camera.focal_px), np.array(camera.centre_px)
    got = (
        f"focal_px {list(camera.focal_px)}, centre_px {list(camera.centre_px)} for {camera.image[0]}×{camera.image[1]}"
    )
    low, high = FOCAL[0] * size.max(), FOCAL[1] * size.max()
    if not ((focal >= low) & (focal <= high)).all() or focal.max() > ASPECT * focal.min():
        return "focal_px", False, got, f"two like focal lengths from {low:g} to {high:g} px"
    if not ((centre >= -CENTRE * size) & (centre <= (1 + CENTRE) * size)).all():
        return "centre_px", False, got, "an image centre near the image"
    corner = np.square(np.maximum(np.abs(centre), np.abs(size - centre)) / focal)
    bend = camera.radial * float(corner.sum())
    expected = f"from {FOLD:.2f} to {BULGE:g} at the corner"
    return "radial", FOLD < bend <= BULGE, f"a lens with radial r² = {bend:.3g} at the image's corner", expected


def _rotation(camera: Camera) -> tuple[str, bool, str, str]:
    r = camera.rotation
    with np.errstate(over="ignore", invalid="ignore"):
        off = float(np.abs(product(r, r.T) - np.eye(3)).max())
        turn = float(dot(r[0], np.cross(r[1], r[2]))) if off <= ROTATION_TOLERANCE else np.nan
    if not off <= ROTATION_TOLERANCE:
        got = f"rows that are no unit vectors at right angles (off by {off:.2g})"
        return "rotation", False, got, "a rotation matrix, world to camera"
    return "rotation", turn > 0, "a mirrored rotation (determinant -1)", "determinant +1: x right, y down, z forward"


def _position(camera: Camera) -> tuple[str, bool, str, str]:
    p = camera.position
    if not (np.abs(p) <= COORDINATE).all():
        return "position", False, str(p.tolist()), f"coordinates within {COORDINATE:g} m"
    return "position", p[2] > 0, f"a camera at height {p[2]:g} m", "above the ground, z = 0 (in m)"


def _scale(camera: Camera) -> tuple[str, bool, str, str]:
    if camera.kind == "top" and not camera.rotation[2, 2] <= -DOWN:
        return "rotation", False, "a camera of kind top that does not look down", "one that looks straight down"
    scale = px_per_m_at_centre(camera)
    good = is_number(scale, *SCALES) or (camera.kind == "pinhole" and np.isnan(scale))
    return "px_per_m", bool(good), f"{scale:g} px per m in the image centre", f"from {SCALES[0]:g} to {SCALES[1]:g}"


def _ground(camera: Camera) -> tuple[str, bool, str, str]:
    w, h = camera.image
    u, v = (a.ravel() for a in np.meshgrid([0.0, w / 2, w], np.linspace(h / 2, h, 5)))
    ground = to_ground(camera, np.concatenate([np.c_[u, v], [camera.centre_px]]))
    return (
        "rotation",
        bool(shows_ground(camera, ground).any()),
        "an image without ground in its lower half",
        "a camera that sees the ground",
    )
