"""Made-up crowds and cameras, and slow, obvious oracles of what a camera sees."""

from __future__ import annotations

import numpy as np

from sim.scene.body import DEPTH_SHARE, SHOULDER_SHARE, ellipsoids
from sim.scene.camera import camera_rotation
from sim.types import Array, Camera, Motion, Order, Scene


def pinhole(tilt: float = 40.0, yaw: float = 0.0, at: tuple[float, float, float] = (8.0, -6.0, 7.0)) -> Camera:
    """640 × 480, focal length 500 px."""
    rotation = camera_rotation(np.deg2rad(tilt), np.deg2rad(yaw))
    return Camera("pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array(at), rotation, 0.12)


def above(yaw: float = 0.0) -> Camera:
    """640 × 480, 40 px/m, over (8, 5)."""
    rotation = camera_rotation(np.pi / 2, np.deg2rad(yaw))
    return Camera(
        "top", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([8.0, 5.0, 20.0]), rotation, px_per_m=40.0
    )


def small(camera: Camera, share: float = 0.25) -> Camera:
    """The same view on fewer or more pixels."""
    width, height = (round(share * n) for n in camera.image)
    focal, middle = (camera.focal_px[0] * share, camera.focal_px[1] * share), (width / 2, height / 2)
    return camera.replace(image=(width, height), focal_px=focal, centre_px=middle, px_per_m=camera.px_per_m * share)


def walkers(
    start: Array,
    velocity: Array,
    *,
    frames: int = 40,
    fps: float = 10.0,
    intent: Array | None = None,
    height: Array | float = 1.7,
    scene: Scene | None = None,
    orders: tuple[Order, ...] = (),
    present: Array | None = None,
) -> Motion:
    """People who walk straight on: start, velocity (P, 2)."""
    start, velocity = np.atleast_2d(np.asarray(start, float)), np.atleast_2d(np.asarray(velocity, float))
    people = len(start)
    t = np.arange(frames)[:, None, None] / fps
    there = np.ones((frames, people), bool) if present is None else np.asarray(present, bool)
    pos = np.where(there[..., None], start + velocity * t, np.nan)
    vel = np.where(there[..., None], np.broadcast_to(velocity, pos.shape), np.nan)
    heading = np.where(there, np.arctan2(velocity[:, 1], velocity[:, 0]), np.nan)
    wanted = np.broadcast_to(np.arange(people), (frames, people)) if intent is None else np.asarray(intent)
    wanted = np.broadcast_to(wanted, (frames, people))
    h = np.broadcast_to(np.asarray(height, float), (people,))
    return Motion(
        "made-up", 7, 0, fps, pos, vel, heading, there, np.where(there, wanted, -1).astype(np.int64), h,
        SHOULDER_SHARE * h, DEPTH_SHARE * h, np.full(people, 1.34), scene or Scene(np.array([16.0, 10.0])), orders,
    )  # fmt: skip


def paced(*pieces: tuple[float, tuple[float, float]], start: tuple[float, float] = (0.0, 0.0)) -> tuple[Array, Array]:
    """Places and velocities (T, 2) of one person, 10 frames/s; pieces: (s, velocity). The velocity of a frame is that
    of the step from it to the next."""
    vel = np.concatenate([np.tile(np.array(v, float), (round(10 * s), 1)) for s, v in pieces])
    return np.array(start) + np.concatenate([[[0, 0]], np.cumsum(vel[:-1], axis=0)]) / 10, vel


def crowd(seed: int, people: int = 12, frames: int = 30, **options: object) -> Motion:
    """People scattered over 16 × 10 m, walking anywhere, of all heights."""
    r = np.random.default_rng(seed)
    start = r.uniform([2, 2], [14, 8], (people, 2))
    return walkers(start, r.normal(0, 0.5, (people, 2)), frames=frames, height=r.uniform(1.5, 1.95, people), **options)  # type: ignore[arg-type]


def surface(pos3: Array, heading: float, height: float, n: int = 120) -> Array:
    """Points (2 n², 3) on the surfaces of one person's body and head, from the definition of an ellipsoid."""
    shapes = ellipsoids(pos3[None], np.array([heading]), np.array([height]))
    theta, phi = np.meshgrid(np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, n))
    unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    points = []
    for centre, shape in zip(shapes.centre[0], shapes.shape[0], strict=True):
        points.append(centre + unit @ np.linalg.cholesky(shape).T)
    return np.concatenate(points)
