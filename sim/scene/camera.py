"""Camera projection: world to image, image to ground with its Jacobian, lines of sight, disparity, image scale.

World: x right, y away, z up (m). Camera: x right, y down, z forward; x_cam = R (X - C) with rotation R and the camera's
position C. Pinhole: u = fx x/z + cx, v = fy y/z + cy with focal lengths fx, fy and image centre cx, cy in px. Top
(orthographic, R looks down): u = s x + cx, v = s y + cy, s = px_per_m.

The lens of a pinhole camera may distort (`radial` = k, of calibrated recordings; Tsai). In units of the focal length,
from the image centre, it shows at the distorted point x, |x| = r, what an ideal lens shows at y = x (1 + k r²). Given
|y| = q, the distorted radius r is the root of r + k r³ = q that continues r = 0: r = 2/√(3k) sinh(asinh(3/2 q √(3k))/3)
for k > 0. For k < 0 sin and asin with √(-3k) replace sinh and asinh; points with q > 2/(3 √(-3k)) are not shown at all.

A rectified stereo pair as a sensor of points: (u, v, d) of a world point, its Jacobian, and the way back.

u, v: pixel in the left image; d = u_left - u_right: disparity, px. With x_c = R (X - C) = (x right, y down, z forward),
R the rotation and C the position of the left camera, f its focal lengths, b the baseline:
    u = u0 + fx x_c / z_c,   v = v0 + fy y_c / z_c,   d = b fx / z_c                 (Hoshikawa et al. 2011, eq. 6)
    d(u, v, d)/dX = J R,   J = [[fx/z, 0, -fx x/z^2], [0, fy/z, -fy y/z^2], [0, 0, -b fx/z^2]]
Eq. 6 is printed with y in place of x, and with world coordinates in place of camera coordinates.

Without a camera, the boxes of people tell the scale of the image. There are two rules on purpose. A tracker gets the
scale of the first boxes (`scale_of_first_boxes`), so that it needs no later frame. The truth, which is read as a whole,
takes that of all labelled boxes (`scale_of_all_boxes`). On PETS09-S2L1, TUD-Campus and TownCentre the scale of the
first 100 boxes is within 11 % of that of all boxes, on CAVIAR's mwt1gt within 12 %.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, PICTURE_SIZES, SCALES, fits_picture, is_number
from sim.elementary import PI, atan2, dot, exp, inverse_3x3, length, log, product, sin, turned, unit
from sim.scene.body import PERSON_HEIGHT
from sim.scene.terrain import height_at
from sim.types import Array, Bools, Camera, Ints, Scene

CLIMB = 8  # Steps in which the height of the ground that is seen at an image point is found.
SHAPE_TOLERANCE = 0.01  # relative difference allowed between the aspect ratios of calibration and recording


def undistort(x: Array, k: float) -> Array:
    """Returns the ideal points y = x (1 + k |x|²) of distorted points x (N, 2), in units of the focal length."""
    if k == 0.0:
        return x
    return np.asarray(x * (1.0 + k * dot(x, x)[:, None]))


def distort(y: Array, k: float) -> Array:
    """Returns the distorted points x (N, 2) of ideal points y (N, 2), the inverse of `undistort`.

    nan where the lens does not show the point.
    """
    if k == 0.0:
        return y
    root = np.sqrt(3.0 * abs(k))
    q = length(y)[:, None]
    known = np.isfinite(q)
    x = np.where(known, 1.5 * q * root, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        if k > 0:
            e = exp(log(x + np.sqrt(x * x + 1.0)) / 3)  # asinh and sinh
            third = (e - 1.0 / e) / 2
        else:
            third = sin(atan2(x, np.sqrt(1.0 - x * x)) / 3)
        r = np.where(x < 0.02, q, third * 2 / root)
        for _ in range(3):  # Newton's steps, where the closed form would lose digits
            r = np.where(x < 0.5, r - (r + k * r * r * r - q) / (1.0 + 3.0 * k * r * r), r)
        return np.asarray(y * np.where(known, np.where(q > 0, r / q, 1.0), np.nan))


def undistort_jacobian(x: Array, k: float) -> Array:
    """Returns the derivative (N, 2, 2) of `undistort` at x (N, 2): (1 + k |x|²) I + 2 k x xᵀ."""
    r2 = dot(x, x)
    return np.asarray((1.0 + k * r2)[:, None, None] * np.eye(2) + 2.0 * k * x[:, :, None] * x[:, None, :])


STEEP_DEG = 70.0  # a camera tilted more than this foreshortens an upright person to a dot
FARTHEST = 10_000.0  # m: ground further away counts as not seen
NEAREST_DEPTH = 0.05  # m: points at this depth or nearer are not projected


def camera_rotation(tilt: float, yaw: float) -> Array:
    """Returns the rotation (3, 3) from world to camera; its rows are right, down and forward in the world.

    tilt: rad, downwards from level. yaw: rad; 0 looks along +y, positive turns left.
    """
    (ct, st), (cy, sy) = unit(tilt), unit(yaw)
    return np.array([[cy, sy, 0.0], [st * sy, -st * cy, -ct], [-sy * ct, cy * ct, -st]])


def project(camera: Camera, xyz: Array) -> tuple[Array, Array]:
    """Returns image points (N, 2) px and depths (N,) m of world points xyz (N, 3); not clipped to the image.

    nan for a pinhole camera where the depth is at most NEAREST_DEPTH, or the lens does not show the point.
    """
    x = turned(camera.rotation, np.asarray(xyz, dtype=float) - camera.position)
    depth = x[:, 2]
    if camera.kind == "top":
        return x[:, :2] * camera.px_per_m + camera.centre_px, depth
    z = np.where(depth > NEAREST_DEPTH, depth, np.nan)
    return distort(x[:, :2] / z[:, None], camera.radial) * camera.focal_px + camera.centre_px, depth


def rays(camera: Camera, uv: Array) -> tuple[Array, Array]:
    """Returns the lines of sight of image points uv (N, 2) px: origins (N, 3) m and directions (N, 3).

    A direction has the length that leads 1 m deeper along the optical axis.
    """
    uv = np.asarray(uv, dtype=float)
    if camera.kind == "top":
        across = (uv - camera.centre_px) / camera.px_per_m
        origin = camera.position + turned(camera.rotation[:2].T, across)
        return origin, np.broadcast_to(camera.rotation[2], origin.shape)
    x = np.ones((len(uv), 3))
    x[:, :2] = undistort((uv - camera.centre_px) / camera.focal_px, camera.radial)
    return np.broadcast_to(camera.position, x.shape), turned(camera.rotation.T, x)


def to_ground(camera: Camera, uv: Array, z: float | Array = 0.0) -> Array:
    """Returns x, y (N, 2) m of the points at height z that are seen at image points uv (N, 2) px.

    z: m, one number or (N,). nan where the line of sight meets no such point in front of the camera.
    """
    return at_height(*rays(camera, uv), z)


def at_height(origin: Array, direction: Array, z: float | Array) -> Array:
    """Returns x, y (..., N, 2) m of the points of height z, m, on lines of sight as of `rays`; nan where none is.

    z: one number, (N,) or (..., N or 1).
    """
    return np.asarray(origin[:, :2] + _reach(origin, direction, z)[..., None] * direction[:, :2])


def seen_ground(camera: Camera, uv: Array, scene: Scene | None) -> Array:
    """Returns the ground points x, y (N, 2) m that are seen at image points uv (N, 2) px.

    The ground is level without a scene. x, y are nan where no ground is seen.
    """
    xy = to_ground(camera, uv)
    if scene is not None and scene.stairs:
        for _ in range(CLIMB):
            xy = to_ground(camera, uv, height_at(scene, xy))
    return xy


def _reach(origin: Array, direction: Array, z: float | Array) -> Array:
    """Returns how far along each ray a point of height z lies, in lengths of its direction; nan where none does."""
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (z - origin[:, 2]) / direction[:, 2]
        return np.where(np.isfinite(s) & (s > 0), s, np.nan)


def foot_points(box: Array, z: Array, camera: Camera) -> Array:
    """Returns the ground points x, y (R, 2) m of people with boxes (R, 4) px; nan where none is seen.

    box: left, top, width, height. z (R,): height of the ground, m. The point is the middle of the lower edge, for kind
    "top" the middle of the box.
    """
    return to_ground(camera, box[:, :2] + box[:, 2:] * np.array([0.5, standing_share(camera)]), z)


def standing_share(camera: Camera | None) -> float:
    """Returns where a person stands in the box, as share of its height from the top: 0.5 for kind "top", else 1."""
    return 0.5 if camera is not None and camera.kind == "top" else 1.0


def ground_jacobian(camera: Camera, uv: Array, z: float | Array = 0.0) -> Array:
    """Returns the derivative d(x, y)/d(u, v) of `to_ground` at image points uv (N, 2) px, (N, 2, 2) m/px.

    The ray X = O + s D meets the plane at s = (z - O_z)/D_z. Then dX = s dD + D ds and ds = -s dD_z/D_z.
    """
    origin, direction = rays(camera, uv)
    if camera.kind == "top":
        return np.broadcast_to(camera.rotation[:2, :2].T / camera.px_per_m, (len(origin), 2, 2))
    focal = np.array(camera.focal_px)
    bend = np.eye(2)[None]
    if camera.radial:
        bend = undistort_jacobian((np.asarray(uv, dtype=float) - camera.centre_px) / focal, camera.radial)
    step = product(np.swapaxes(bend / focal, 1, 2), camera.rotation[:2])  # dD/du, dD/dv as rows
    s = _reach(origin, direction, z)
    slope = direction[:, :2] / np.where(np.isfinite(s), direction[:, 2], np.nan)[:, None]
    dx = step[:, :, :2] - step[:, :, 2:] * slope[:, None]
    return np.asarray(np.swapaxes(s[:, None, None] * dx, 1, 2))


def right_camera(camera: Camera) -> Camera:
    """Returns the right camera of a stereo pair: the left one, moved by its baseline along its own x axis."""
    return camera.replace(position=camera.position + camera.baseline * camera.rotation[0])


def misaligned(camera: Camera, roll: float, down: float) -> Camera:
    """Returns a pinhole camera whose image is turned clockwise by `roll` (rad), then moved down by `down` px."""
    c, s = unit(roll)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return camera.replace(
        rotation=product(turn, camera.rotation), centre_px=(camera.centre_px[0], camera.centre_px[1] + down)
    )


def disparity(camera: Camera, depth: Array) -> Array:
    """Returns the disparity f B / z in px for depths z (m) of any shape; 0 for a camera of kind "top"."""
    if camera.kind == "top":
        return np.zeros_like(depth)
    return np.asarray(camera.focal_px[0] * camera.baseline / depth)


def px_per_m_at_centre(camera: Camera) -> float:
    """Returns the scale of the image, px per m, at the ground point seen in the image centre.

    For a pinhole camera it is the height in px of a standard person there, divided by 1.7 m. If the camera is tilted by
    more than 70°, it is the focal length over the depth. If the centre shows no ground, a point below it is taken.
    """
    if camera.kind == "top":
        return camera.px_per_m
    foot = to_ground(camera, np.array([camera.centre_px]))[0]
    if not shows_ground(camera, foot):
        foot = _low_ground(camera)
    base = np.array([*foot, 0.0])
    uv, depth = project(camera, np.stack([base, base + np.array([0.0, 0.0, PERSON_HEIGHT])]))
    # Seen from above, an upright person is a dot.
    if -camera.rotation[2, 2] > float(sin(STEEP_DEG / 180.0 * PI)):
        return float(camera.focal_px[1] / depth[0])
    return float(length(uv[1] - uv[0]) / PERSON_HEIGHT)


BOXES = 100  # boxes that the first frames must hold together


def scale_of_first_boxes(frame: Ints, height: Array) -> tuple[float, int]:
    """Returns the image scale, px per m, and the last frame from which it was taken.

    It is the median box height over 1.7 m, of the first frames that together hold 100 boxes (else all). frame, height
    (R,): of each box, in any order; height in px, nan is ignored. (nan, 0) without boxes.
    """
    known = np.isfinite(height)
    frame, height = frame[known], height[known]
    if not len(frame):
        return float("nan"), 0
    last = int(np.sort(frame)[min(BOXES, len(frame)) - 1])
    return float(np.median(height[frame <= last])) / PERSON_HEIGHT, last


def scale_of_all_boxes(height: Array) -> float:
    """Returns the image scale, px per m: the median of box heights (R,) px over 1.7 m; nan without boxes."""
    return float(np.median(height)) / PERSON_HEIGHT if len(height) else float("nan")


def shows_ground(camera: Camera, ground: Array) -> Bools:
    """Returns flags (...): True for ground points (..., 2) m within 10 km of the camera horizontally; False for nan."""
    return np.asarray(length(ground - camera.position[:2]) < FARTHEST)


def _low_ground(camera: Camera) -> Array:
    """Returns a ground point (2,) that the camera sees below its image centre, else one 10 m ahead of it."""
    u, bottom = camera.centre_px[0], float(camera.image[1])
    v = np.linspace(camera.centre_px[1], bottom, 129)
    ground = to_ground(camera, np.column_stack([np.full_like(v, u), v]))
    seen = np.flatnonzero(shows_ground(camera, ground))
    if not len(seen):
        ahead = camera.rotation[2, :2] / max(float(length(camera.rotation[2, :2])), 1e-12)
        return np.asarray(camera.position[:2] + 10.0 * ahead)
    return np.asarray(ground[(seen[0] + len(v) - 1) // 2])


ROTATION_TOLERANCE = 0.01  # difference of R Rᵀ from the identity: rotations are often written with three decimals
FOCAL = (0.1, 100.0)  # focal length in widths of the image: a fisheye has some 0.3, a telescope 50
ASPECT = 2.0  # greatest ratio of the two focal lengths
DOWN = 0.99  # least downward part of the forward axis of a camera of kind "top"


def require_camera(camera: Camera, file: object = "", place: str = "") -> Camera:
    """Returns the camera unchanged if it can be used, else raises InputError. file, place: for the error message."""
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
        turn = float(dot(r[0], np.cross(r[1], r[2])))
    got = f"rows that are no unit vectors at right angles (off by {off:.2g}), or mirrored (determinant {turn:.2g})"
    expected = "a rotation matrix, world to camera: x right, y down, z forward"
    yield "rotation", off <= ROTATION_TOLERANCE and turn > 0, got, expected
    good, expected = bool((np.abs(p) <= COORDINATE).all() and p[2] > 0), f"within {COORDINATE:g} m, above the ground"
    yield "position", good, f"a camera at {p.tolist()} m", expected
    down = camera.kind == "pinhole" or bool(r[2, 2] <= -DOWN)
    yield "rotation", down, "a camera of kind top that does not look down", "one that looks straight down"
    scale = px_per_m_at_centre(camera)
    good = is_number(scale, *SCALES) or (camera.kind == "pinhole" and bool(np.isnan(scale)))
    yield "px_per_m", good, f"{scale:g} px per m in the image centre", f"from {SCALES[0]:g} to {SCALES[1]:g}"
    u, v = (a.ravel() for a in np.meshgrid([0.0, w / 2, w], np.linspace(h / 2, h, 5)))
    seen = shows_ground(camera, to_ground(camera, np.concatenate([np.c_[u, v], [camera.centre_px]])))
    yield "rotation", bool(seen.any()), "an image without ground in its lower half", "a camera that sees the ground"


def _lens(camera: Camera) -> Iterator[tuple[str, bool, str, str]]:
    size, focal = np.array(camera.image), np.array(camera.focal_px)
    (w, h), low, high = camera.image, FOCAL[0] * size.max(), FOCAL[1] * size.max()
    got = f"focal_px {list(camera.focal_px)}, centre_px {list(camera.centre_px)} for {w}×{h}"
    alike = ((focal >= low) & (focal <= high)).all() and focal.max() <= ASPECT * focal.min()
    yield "focal_px", bool(alike), got, f"two like focal lengths from {low:g} to {high:g} px"


def project_pair(camera: Camera, xyz: Array) -> Array:
    """Returns u, v, d (N, 3) px of world points xyz (N, 3) m in front of the left camera `camera` (eq. 6)."""
    x = turned(camera.rotation, xyz - camera.position)
    (fx, fy), (u0, v0) = camera.focal_px, camera.centre_px
    z = x[:, 2]
    return np.column_stack([u0 + fx * x[:, 0] / z, v0 + fy * x[:, 1] / z, camera.baseline * fx / z])


def back_project(camera: Camera, uvd: Array) -> Array:
    """Returns the world points (N, 3) m whose image is uvd (N, 3) px; the inverse of `project_pair`, for d above 0."""
    (fx, fy), (u0, v0) = camera.focal_px, camera.centre_px
    z = camera.baseline * fx / uvd[:, 2]
    x = np.column_stack([(uvd[:, 0] - u0) / fx * z, (uvd[:, 1] - v0) / fy * z, z])
    return np.asarray(turned(camera.rotation.T, x) + camera.position)


def pair_jacobian(camera: Camera, xyz: Array) -> Array:
    """Returns d(u, v, d)/d(x, y, z) of `project_pair` at xyz (N, 3): (N, 3, 3) px/m."""
    x = turned(camera.rotation, xyz - camera.position)
    (fx, fy), z = camera.focal_px, x[:, 2]
    J = np.zeros((len(x), 3, 3))
    J[:, 0, 0], J[:, 0, 2] = fx / z, -fx * x[:, 0] / (z * z)
    J[:, 1, 1], J[:, 1, 2] = fy / z, -fy * x[:, 1] / (z * z)
    J[:, 2, 2] = -camera.baseline * fx / (z * z)
    return product(J, camera.rotation)


def point_covariances(camera: Camera, xyz: Array, variances: Array) -> Array:
    """Returns the covariances J⁻¹ R J⁻ᵀ (N, 3, 3) m² of measured points xyz (N, 3); variances (3,) px²: of u, v, d."""
    inverse = inverse_3x3(pair_jacobian(camera, xyz))
    return product(inverse * variances, np.swapaxes(inverse, 1, 2))


def scaled_to_image(
    camera: Camera, image: tuple[int, int] | None, path: str | Path, aspect: Fraction = Fraction(1)
) -> Camera:
    """Returns the camera scaled to pictures of `image` (width, height) px; unchanged for None or the same size.

    aspect: width / height of a stored pixel. Raises InputError if the pictures have another shape than the calibration.
    """
    if image is None or image == camera.image:
        return camera
    x, y = image[0] / camera.image[0], image[1] / camera.image[1]
    # It may be calibrated with the stored pixels or with square ones.
    if all(abs(x / y / ratio - 1) > SHAPE_TOLERANCE for ratio in (1.0, float(aspect))):
        got, expected = "a calibration for {}×{} px".format(*camera.image), "one for {}×{} px, or of that shape"
        raise InputError(
            file=path, place="--camera", got=got, expected=expected.format(*image),
            remedy="give this recording's calibration",
        )  # fmt: skip
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    scale = float(camera.px_per_m * np.sqrt(x * y))
    return camera.replace(image=image, focal_px=(fx * x, fy * y), centre_px=(cx * x, cy * y), px_per_m=scale)
