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


def first_hit(origin: Array, direction: Array, centre: Array, shape: Array) -> Array:
    """Ray parameters (R,) at which rays (R, 3) first meet the ellipsoid; inf where they miss it."""
    inverse = np.linalg.inv(shape)
    o = origin - centre
    a = np.einsum("ri,ij,rj->r", direction, inverse, direction)
    b = np.einsum("ri,ij,rj->r", o, inverse, direction)
    c = np.einsum("ri,ij,rj->r", o, inverse, o) - 1
    root = b * b - a * c
    s = (-b - np.sqrt(np.maximum(root, 0))) / a
    return np.where((root >= 0) & (s > 0), s, np.inf)


def disc_hit(
    origin: Array, direction: Array, pillar: Array, tall: float, steps: int = 2000, far: float = 20.0
) -> Array:
    """First ray parameter inside an upright cylinder, by marching along the ray; inf where it misses."""
    s = np.linspace(0, far, steps)
    x = origin[:, None] + s[None, :, None] * direction[:, None]
    inside = (
        (np.hypot(x[..., 0] - pillar[0], x[..., 1] - pillar[1]) <= pillar[2]) & (x[..., 2] >= 0) & (x[..., 2] <= tall)
    )
    return np.where(inside.any(axis=1), s[inside.argmax(axis=1)], np.inf)


def wall_hit(origin: Array, direction: Array, wall: Array, tall: float, far: float = 20.0, steps: int = 2000) -> Array:
    """First ray parameter beyond the wall's line, by marching; inf where the crossing lies beside or above the wall."""
    s = np.linspace(0, far, steps)
    x = origin[:, None] + s[None, :, None] * direction[:, None]
    along = (wall[1] - wall[0]) / np.linalg.norm(wall[1] - wall[0])
    side = (x[..., 0] - wall[0, 0]) * along[1] - (x[..., 1] - wall[0, 1]) * along[0]
    crossed = side[:, 1:] * side[:, :1] < 0
    k = crossed.argmax(axis=1) + 1
    at = x[np.arange(len(x)), k]
    t = (at[:, :2] - wall[0]) @ along
    hit = (
        crossed.any(axis=1) & (t >= 0) & (t <= np.linalg.norm(wall[1] - wall[0])) & (at[:, 2] >= 0) & (at[:, 2] <= tall)
    )
    return np.where(hit, s[k], np.inf)


def raster_visibility(camera: Camera, scene: Scene, pos3: Array, heading: Array, height: Array, n: int = 60) -> Array:
    """Share of each person's silhouette that is visible, (N,): n × n rays over the amodal box, nearest surface wins."""
    from sim.scene.body import person_boxes
    from sim.scene.camera import rays

    shapes = ellipsoids(pos3, heading, height)
    out = np.zeros(len(pos3))
    for i, (left, top, width, tall) in enumerate(person_boxes(camera, pos3, heading, height)):
        u, v = np.meshgrid(left + (np.arange(n) + 0.5) / n * width, top + (np.arange(n) + 0.5) / n * tall)
        origin, direction = rays(camera, np.column_stack([u.ravel(), v.ravel()]))
        hits = np.full((len(pos3), len(origin)), np.inf)
        for j, k in np.ndindex(len(pos3), 2):
            hits[j] = np.minimum(hits[j], first_hit(origin, direction, shapes.centre[j, k], shapes.shape[j, k]))
        mine = hits[i]
        on = np.isfinite(mine)
        others = np.delete(hits, i, axis=0).min(axis=0, initial=np.inf)
        for pillar in scene.pillars if camera.kind == "pinhole" else ():
            others = np.minimum(others, disc_hit(origin, direction, pillar, scene.pillar_height))
        for wall in scene.walls if camera.kind == "pinhole" else ():
            others = np.minimum(others, wall_hit(origin, direction, wall, scene.wall_height))
        in_image = (u.ravel() >= 0) & (u.ravel() < camera.image[0]) & (v.ravel() >= 0) & (v.ravel() < camera.image[1])
        out[i] = (on & in_image & (mine < others)).sum() / on.sum()
    return out


def twin_look(
    camera: Camera, box: Array, centre: Array, shape: Array, distance: Array, columns: int, rows: int
) -> Array:
    """The kernel's visibility for one frame of people alone, (N,), by numpy over the same grid."""
    out = np.zeros(len(box))
    inverse = np.linalg.inv(shape)

    def inside(j: int, points: Array) -> Array:
        d = points[:, None] - centre[j]
        return (np.einsum("nki,kij,nkj->nk", d, inverse[j], d) <= 1).any(axis=1)

    for i, (left, top, width, height) in enumerate(box):
        u = left + (np.arange(columns) + 0.5) * width / columns
        v = top + (np.arange(rows) + 0.5) * height / rows
        points = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
        points = points[inside(i, points)]
        seen = ((points >= 0) & (points < camera.image)).all(axis=1)
        for j in range(len(box)):
            if distance[j] < distance[i]:
                seen &= ~inside(j, points)
        out[i] = seen.mean()
    return out
