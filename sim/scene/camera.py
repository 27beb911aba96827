"""What a camera sees: projection, back-projection to the ground, depth, Jacobian, disparity, scale.

World x right, y away, z up (m); camera x right, y down, z forward: x_cam = R (X - C).
pinhole: u = fx x/z + cx, v = fy y/z + cy.  top: u = s x + cx, v = s y + cy, s = px_per_m (orthographic, R looks down).
A pinhole's lens may distort (`radial`, of calibrated recordings): sim.scene.lens bends x/z, y/z before they become px.
Where the camera stands is found by sim.scene.viewpoint; `solve` is here for its callers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.scene import lens
from sim.types import Array, Camera, Motion

if TYPE_CHECKING:
    from scenarios.schema.scenario import CameraSpec

PERSON = 1.7  # m: the upright person that gives an image its scale
STEEP_DEG = 70.0  # from here on an upright person is foreshortened to a dot: the ground's own scale is used
NEAR = 0.05  # m: nothing nearer than this is projected


def looking(tilt: float, yaw: float) -> Array:
    """Rotation (3, 3) world → camera: rows right, down, forward; tilt > 0 looks down, yaw > 0 turns left (radians)."""
    ct, st, cy, sy = np.cos(tilt), np.sin(tilt), np.cos(yaw), np.sin(yaw)
    return np.array([[cy, sy, 0.0], [st * sy, -st * cy, -ct], [-sy * ct, cy * ct, -st]])


def solve(spec: CameraSpec, motion: Motion) -> Camera:
    """The camera of a scenario, put where it sees every body of the Motion; see sim.scene.viewpoint.solve."""
    from sim.scene.viewpoint import solve as find

    return find(spec, motion)


def project(camera: Camera, xyz: Array) -> tuple[Array, Array]:
    """Image points (N, 2) px and depths (N,) m along the optical axis; nan behind a pinhole camera.

    nan also where a lens with radial < 0 shows nothing of it.
    """
    x = (np.asarray(xyz, dtype=float) - camera.position) @ camera.rotation.T
    depth = x[:, 2]
    if camera.kind == "top":
        return x[:, :2] * camera.px_per_m + camera.centre_px, depth
    z = np.where(depth > NEAR, depth, np.nan)
    return lens.bent(x[:, :2] / z[:, None], camera.radial) * camera.focal_px + camera.centre_px, depth


def rays(camera: Camera, uv: Array) -> tuple[Array, Array]:
    """Lines of sight of image points (N, 2): origins (N, 3) and directions (N, 3) of depth 1 m per unit."""
    uv = np.asarray(uv, dtype=float)
    if camera.kind == "top":
        across = (uv - camera.centre_px) / camera.px_per_m
        origin = camera.position + across @ camera.rotation[:2]
        return origin, np.broadcast_to(camera.rotation[2], origin.shape)
    x = np.ones((len(uv), 3))
    x[:, :2] = lens.straight((uv - camera.centre_px) / camera.focal_px, camera.radial)
    return np.broadcast_to(camera.position, x.shape), x @ camera.rotation


def to_ground(camera: Camera, uv: Array, z: float = 0.0) -> Array:
    """Points (N, 2) m of the plane at height z behind image points (N, 2); nan at and above the horizon."""
    origin, direction = rays(camera, uv)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (z - origin[:, 2]) / direction[:, 2]
        s = np.where(np.isfinite(s) & (s > 0), s, np.nan)
    return origin[:, :2] + s[:, None] * direction[:, :2]


def ground_jacobian(camera: Camera, uv: Array, z: float = 0.0) -> Array:
    """d(x, y)/d(u, v) of `to_ground`, (N, 2, 2) in m/px.

    With the ray X = O + s D and s = (z - O_z)/D_z: dX = s dD + D ds, ds = -s dD_z/D_z (pinhole; orthographic dX = dO).
    """
    origin, direction = rays(camera, uv)
    if camera.kind == "top":
        return np.broadcast_to(camera.rotation[:2, :2].T / camera.px_per_m, (len(origin), 2, 2))
    focal = np.array(camera.focal_px)
    bend = np.eye(2)[None]
    if camera.radial:
        bend = lens.slope((np.asarray(uv, dtype=float) - camera.centre_px) / focal, camera.radial)
    step = np.swapaxes(bend / focal, 1, 2) @ camera.rotation[:2]  # dD/du, dD/dv as rows
    s = (z - origin[:, 2]) / direction[:, 2]
    slope = direction[:, :2] / direction[:, 2:]
    dx = step[:, :, :2] - step[:, :, 2:] * slope[:, None]
    return np.asarray(np.swapaxes(s[:, None, None] * dx, 1, 2))


def right(camera: Camera) -> Camera:
    """The right camera of the pair: `baseline` further along camera x."""
    return camera.replace(position=camera.position + camera.baseline * camera.rotation[0])


def disparity(camera: Camera, depth: Array) -> Array:
    """u_left - u_right = f B / z in px, for depths in m; an orthographic pair has none."""
    if camera.kind == "top":
        return np.zeros_like(depth)
    return np.asarray(camera.focal_px[0] * camera.baseline / depth)


def px_per_m_at_centre(camera: Camera) -> float:
    """The image's scale: pixel height of an upright 1.7 m person at the image centre's ground point, over 1.7 m.

    top: px_per_m. Looking down steeper than STEEP_DEG: focal length over distance of the ground. Where the centre
    shows no ground, the middle between horizon and lower edge stands for it (the edge's own scale if all is sky).
    """
    if camera.kind == "top":
        return camera.px_per_m
    foot = to_ground(camera, np.array([camera.centre_px]))[0]
    if not np.isfinite(foot).all():
        foot = _low_ground(camera)
    base = np.array([*foot, 0.0])
    uv, depth = project(camera, np.stack([base, base + np.array([0.0, 0.0, PERSON])]))
    if -camera.rotation[2, 2] > np.sin(np.deg2rad(STEEP_DEG)):
        return float(camera.focal_px[1] / depth[0])
    return float(np.linalg.norm(uv[1] - uv[0]) / PERSON)


def _low_ground(camera: Camera) -> Array:
    """The ground between horizon and lower edge; 10 m ahead where the image shows none."""
    u, bottom = camera.centre_px[0], float(camera.image[1])
    v = np.linspace(camera.centre_px[1], bottom, 129)
    ground = to_ground(camera, np.column_stack([np.full_like(v, u), v]))
    seen = np.flatnonzero(np.isfinite(ground).all(axis=1))
    if not len(seen):
        ahead = camera.rotation[2, :2] / max(float(np.linalg.norm(camera.rotation[2, :2])), 1e-12)
        return np.asarray(camera.position[:2] + 10.0 * ahead)
    return np.asarray(ground[(seen[0] + len(v) - 1) // 2])
