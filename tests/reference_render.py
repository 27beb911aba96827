"""A slow, obvious renderer: every ray against every body, wall, pillar, box and step, by the formulas of a textbook."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sim.scene.body import ellipsoids, outline_boxes, outlines, recorded_bodies, recorded_things
from sim.scene.terrain import height_at
from sim.types import Array, Bools, Camera, Ints, Motion, Scene

NEVER = np.inf


@dataclass(frozen=True)
class Seen:
    """depth (H, W) m, inf = sky; ids (H, W); amodal: id → mask of the whole silhouette; place (H, W, 3)."""

    depth: Array
    ids: Ints
    amodal: dict[int, Bools]
    place: Array


def lines(camera: Camera) -> tuple[Array, Array]:
    """Origins and directions (H * W, 3) through the middles of pixels, row by row; depth 1 m per unit."""
    width, height = camera.image
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    u, v = u.ravel() - camera.centre_px[0], v.ravel() - camera.centre_px[1]
    right, down, forward = camera.rotation
    if camera.kind == "top":
        s = camera.px_per_m
        return camera.position + np.outer(u / s, right) + np.outer(v / s, down), np.tile(forward, (len(u), 1))
    fx, fy = camera.focal_px
    return np.tile(camera.position, (len(u), 1)), np.outer(u / fx, right) + np.outer(v / fy, down) + forward


def ball(o: Array, d: Array, centre: Array, shape: Array) -> Array:
    """Where o + t d first meets (x - c)ᵀ S⁻¹ (x - c) = 1."""
    M, w = np.linalg.inv(shape), o - centre
    a, b, c = (np.einsum("ni,ni->n", x @ M, y) for x, y in ((d, d), (w, d), (w, w)))  # x @ M @ y of each row
    root = b * b - a * (c - 1)
    t = (-b - np.sqrt(np.maximum(root, 0))) / a
    return np.where((root >= 0) & (t > 0), t, NEVER)


def box(o: Array, d: Array, low: Array, high: Array) -> Array:
    """Where a ray enters an upright box, by slabs."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.stack([(low - o) / d, (high - o) / d])
    enter, leave = np.nanmax(t.min(axis=0), axis=1), np.nanmin(t.max(axis=0), axis=1)
    return np.where((enter <= leave) & (enter > 0), enter, NEVER)


def still(o: Array, d: Array, scene: Scene) -> tuple[Array, Bools]:
    """First hit with ground, walls, pillars, boxes and stairs that rise, and whether it is a wall, pillar or box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ground = np.where(d[:, 2] < 0, -o[:, 2] / d[:, 2], NEVER)
    others, solids = [np.where(ground > 0, ground, NEVER)], [np.full(len(o), NEVER)]
    for (ax, ay), (bx, by) in scene.walls:
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = d[:, 0] * (by - ay) - d[:, 1] * (bx - ax)
            t = ((ax - o[:, 0]) * (by - ay) - (ay - o[:, 1]) * (bx - ax)) / cross
            s = ((ax - o[:, 0]) * d[:, 1] - (ay - o[:, 1]) * d[:, 0]) / cross
            z = o[:, 2] + t * d[:, 2]
        solids.append(np.where((t > 0) & (s >= 0) & (s <= 1) & (z >= 0) & (z <= scene.wall_height), t, NEVER))
    for x, y, r in scene.pillars:
        solids.append(cylinder(o, d, np.array([x, y]), r, scene.pillar_height))
    for b in scene.boxes:
        turn = Rotation.from_euler("ZX", [b.turn_deg, -b.tilt_deg], degrees=True).as_matrix()  # its own axes as columns
        solids.append(box((o - b.at) @ turn, d @ turn, -b.size / 2, b.size / 2))
    for stairs in scene.stairs:
        axis = (stairs.head - stairs.foot) / np.hypot(*(stairs.head - stairs.foot))
        length = float(np.hypot(*(stairs.head - stairs.foot)))
        turn = np.array([[axis[0], axis[1], 0], [-axis[1], axis[0], 0], [0, 0, 1]])
        oo, dd = (o - [*stairs.foot, 0.0]) @ turn.T, d @ turn.T
        for k in range(1, stairs.steps + 1):
            first, end = (k - 0.5) / stairs.steps * length, length + stairs.landing
            low, high = [first, -stairs.width / 2, 0], [end, stairs.width / 2, k * stairs.rise / stairs.steps]
            others.append(box(oo, dd, np.array(low), np.array(high)))
    t, solid = np.min(others, axis=0), np.min(solids, axis=0)
    return np.minimum(t, solid), solid < t


def cylinder(o: Array, d: Array, axis: Array, r: float, height: float) -> Array:
    """Where a ray first meets an upright cylinder's side or top."""
    w = o[:, :2] - axis
    a, b, c = (d[:, :2] ** 2).sum(1), (w * d[:, :2]).sum(1), (w**2).sum(1) - r * r
    with np.errstate(divide="ignore", invalid="ignore"):
        side = np.where((b * b - a * c > 0), (-b - np.sqrt(np.maximum(b * b - a * c, 0))) / a, NEVER)
        z = o[:, 2] + np.where(np.isfinite(side), side, 0) * d[:, 2]
        side = np.where((side > 0) & (z >= 0) & (z <= height), side, NEVER)
        top = (height - o[:, 2]) / d[:, 2]
        at = w + np.where(np.isfinite(top), top, 0)[:, None] * d[:, :2]
    return np.minimum(side, np.where((top > 0) & (d[:, 2] < 0) & ((at**2).sum(1) <= r * r), top, NEVER))


def bodies(motion: Motion, index: int, camera: Camera | None = None) -> list[tuple[int, Array, Array]]:
    """(id, centre, shape) of each part of each person, and of each thing (id -2) that is wholly before a camera."""
    if motion.looks is not None:
        people, things = (found(motion, index, index + 1) for found in (recorded_bodies, recorded_things))
        parts = [(int(id), people.shapes, k) for k, id in enumerate(people.id)]
        if things is not None:
            every = np.ones(len(things.id), bool)
            whole = every if camera is None else np.isfinite(outline_boxes(outlines(camera, things.shapes))).all(axis=1)
            parts += [(-2, things.shapes, k) for k in np.flatnonzero(whole)]
        return [(id, c, s) for id, b, k in parts for c, s in zip(b.centre[k], b.shape[k], strict=True)]
    who = np.flatnonzero(motion.present[index - 1])
    xy = motion.pos[index - 1, who]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    shapes = ellipsoids(pos3, motion.heading[index - 1, who], motion.height[who], motion.width[who], motion.depth[who])
    return [(int(p) + 1, shapes.centre[k, e], shapes.shape[k, e]) for k, p in enumerate(who) for e in range(2)]


def look(camera: Camera, motion: Motion, index: int) -> Seen:
    """Everything, seen through the middle of each pixel."""
    o, d = lines(camera)
    depth, solid = still(o, d, motion.scene)
    ids = np.where(solid, -2, 0)
    amodal: dict[int, Bools] = {}
    for person, centre, shape in bodies(motion, index, camera):
        t = ball(o, d, centre, shape)
        amodal[person] = amodal.get(person, np.zeros(len(t), bool)) | np.isfinite(t)
        ids, depth = np.where(t < depth, person, ids), np.minimum(t, depth)
    place = o + np.where(np.isfinite(depth), depth, 0)[:, None] * d
    size = camera.image[1], camera.image[0]
    masks = {person: mask.reshape(size) for person, mask in amodal.items()}
    return Seen(depth.reshape(size), ids.reshape(size), masks, place.reshape(*size, 3))


def disparity(seen: Seen, camera: Camera, motion: Motion, index: int, gap: float = 1e-3) -> Array:
    """f B / z (H, W) of what the left camera sees; nan where the right one sees nothing, or what is `gap` m nearer."""
    eye = camera.position + camera.baseline * camera.rotation[0]
    points = seen.place.reshape(-1, 3)
    x = (points - eye) @ camera.rotation.T
    depth = seen.depth.ravel()
    with np.errstate(divide="ignore", invalid="ignore"):
        u = x[:, 0] / x[:, 2] * camera.focal_px[0] + camera.centre_px[0]
    d = (points - eye) / np.where(np.isfinite(depth), depth, 1.0)[:, None]  # depth 1 m per unit, as from the left
    o = np.tile(eye, (len(points), 1))
    first = still(o, d, motion.scene)[0]
    for _, centre, shape in bodies(motion, index, camera):
        first = np.minimum(first, ball(o, d, centre, shape))
    known = np.isfinite(depth) & (u >= 0) & (first >= depth - gap)
    return np.where(known, camera.focal_px[0] * camera.baseline / depth, np.nan).reshape(seen.depth.shape)


def in_shadow(points: Array, motion: Motion, index: int, sun: Array) -> Bools:
    """Whether somebody stands between each point (..., 3) and the sun."""
    o = points.reshape(-1, 3) + 1e-6 * sun
    d = np.tile(sun, (len(o), 1))
    hit = np.min([ball(o, d, centre, shape) for _, centre, shape in bodies(motion, index)], axis=0)
    return np.asarray(np.isfinite(hit).reshape(points.shape[:-1]))
