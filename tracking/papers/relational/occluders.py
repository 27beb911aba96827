"""Who is hidden from the camera: the belief in occlusion of sec. 2.1.1.

A person is taken as hidden if the line from a pinhole camera to the middle of the body meets a pillar or a wall of a
known scene, or if the body of another person leaves too little of the own to be seen. Without a pinhole camera nobody
is hidden.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Camera, Scene
from tracking.papers.relational import particle_set_kernels
from tracking.papers.relational.particle_set import ParticleSet

MIDDLE = 0.85  # Height of the middle of a body, m.


def hidden_share(pos: Array, weights: Array, camera: Camera | None, scene: Scene | None) -> Array:
    """Returns the probability (K,) that each person is behind a pillar or wall."""
    if camera is None or scene is None or camera.kind != "pinhole" or not len(scene.pillars) + len(scene.walls):
        return np.zeros(pos.shape[1])
    hidden = np.zeros(pos.shape[:2], bool)
    for pillar in scene.pillars:
        hidden |= _behind_pillar(pos, pillar, scene.pillar_height, camera.position)
    for wall in scene.walls:
        hidden |= _behind_wall(pos, wall, scene.wall_height, camera.position)
    return particle_set_kernels.column_sums(weights, hidden.astype(float))


def _behind_pillar(pos: Array, pillar: Array, top: float, eye: Array) -> Bools:
    to_person, to_pillar = pos - eye[:2], pillar[:2] - eye[:2]
    toward = to_person[..., 0] * to_pillar[0] + to_person[..., 1] * to_pillar[1]
    along = np.clip(toward / np.maximum(np.square(to_person).sum(axis=2), 1e-12), 0.0, 1.0)
    apart = to_person * along[..., None] - to_pillar
    return np.asarray((np.square(apart).sum(axis=2) < pillar[2] ** 2) & (_height(along, eye) < top))


def _behind_wall(pos: Array, wall: Array, top: float, eye: Array) -> Bools:
    to_person, side, start = pos - eye[:2], wall[1] - wall[0], wall[0] - eye[:2]
    det = to_person[..., 0] * side[1] - to_person[..., 1] * side[0]
    det = np.where(np.abs(det) < 1e-12, np.inf, det)
    along = (start[0] * side[1] - start[1] * side[0]) / det
    place = (start[0] * to_person[..., 1] - start[1] * to_person[..., 0]) / det
    meets = (along > 0) & (along < 1) & (place >= 0) & (place <= 1)
    return np.asarray(meets & (_height(along, eye) < top))


def _height(along: Array, eye: Array) -> Array:
    return np.asarray(eye[2] + along * (MIDDLE - eye[2]))


HEIGHT = 1.7  # Height of a body, m.
LEAST_VISIBLE = 0.2  # A person is hidden if a smaller share of the body is visible.


def covered_by_people(particles: ParticleSet, camera: Camera | None, radius: float) -> tuple[Array, Array]:
    """Returns the probabilities (K,) that each person is hidden behind another one, and that the feet are (ours)."""
    p, hidden, cut = particles, np.zeros(particles.people), np.zeros(particles.people)
    if camera is not None and camera.kind == "pinhole" and radius > 0:
        axes = np.ascontiguousarray(np.moveaxis(p.pos, 2, 0))
        mean = np.stack([particle_set_kernels.column_sums(p.weights, places) for places in axes], axis=1)
        cover(p.pos, p.weights, mean, p.existence, camera.position, radius, hidden, cut)
    return hidden, cut


@njit(cache=True)
def cover(
    pos: Array, weights: Array, mean: Array, exist: Array, eye: Array, radius: float, hidden: Array, cut: Array
) -> None:
    """Writes the probabilities (K,) that each person is hidden behind another one, and that the feet are.

    pos (P, K, 2), m; weights (P, K): of the particles, sum 1 for each person; mean (K, 2): of the places, m; exist
    (K,): probability that each person exists; eye (3,): the camera, m. radius: half the width of a body, m.

    Another person at the mean place covers the share 1 - d / (2 radius) of the body's width, d being the distance to
    the line of sight, and the body's height up to where the line of sight over the other's head meets it.
    """
    particles, n, _ = pos.shape
    for k in range(n):
        for other in range(n):
            to_x, to_y = mean[other, 0] - eye[0], mean[other, 1] - eye[1]
            own_x, own_y = mean[k, 0] - eye[0], mean[k, 1] - eye[1]
            own2 = own_x * own_x + own_y * own_y
            if other == k or own2 == 0.0 or to_x * own_x + to_y * own_y > own2:
                continue
            low, behind = 0.0, 0.0
            for p in range(particles):
                x, y = pos[p, k, 0] - eye[0], pos[p, k, 1] - eye[1]
                square = x * x + y * y
                if square == 0.0:
                    continue
                along = (x * to_x + y * to_y) / square
                if along <= 0.0 or along >= 1.0:
                    continue
                side = abs(x * to_y - y * to_x) / math.sqrt(square)
                top = eye[2] - (eye[2] - HEIGHT) / along
                if side >= 2.0 * radius or top <= 0.0:
                    continue
                share = 1.0 - side / (2.0 * radius)
                low += weights[p, k] * share
                if 1.0 - share * min(top / HEIGHT, 1.0) < LEAST_VISIBLE:
                    behind += weights[p, k]
            cut[k] = max(cut[k], exist[other] * low)
            hidden[k] = max(hidden[k], exist[other] * behind)
