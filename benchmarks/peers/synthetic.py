"""Sequences of boxes with occlusion, on which defaults were chosen: people walk on a plane before a tilted camera.

This is a short model of its own, independent of the simulator, so that the defaults of a tracker are not fitted to the
simulator. Its detector fails like real ones. It misses people behind people and posts, its errors are correlated over
time, overlapping boxes suppress each other or become one box, and false boxes last for some frames or come back in the
same places. `walk` returns such a scene; `plain` returns squares with constant velocity, on which trackers are timed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WIDTH, HEIGHT = 640.0, 480.0


@dataclass(frozen=True)
class Boxes:
    """fps: frames/s; size: of the image, px; per frame ids (N,), truth (N, 4) true boxes, found (M, 5) boxes and score.

    Boxes are left, top, width, height, px.
    """

    name: str
    fps: float
    size: tuple[int, int]
    ids: list[np.ndarray]
    truth: list[np.ndarray]
    found: list[np.ndarray]


def plain(n: int, frames: int = 200, p_detect: float = 1.0, clutter: float = 0.0, seed: int = 1) -> Boxes:
    """Returns n squares of 40 px with constant velocity in 1920 x 1080 px, detected in random order.

    p_detect: detection probability; clutter: mean number of false boxes per frame. The standard deviation of a detected
    centre is 1.5 px.
    """
    r = np.random.default_rng(seed)
    p = np.c_[r.uniform(200, 1720, n), r.uniform(150, 930, n)]
    angle, speed = r.uniform(0, 2 * np.pi, n), r.uniform(1, 3, n)
    v = np.c_[speed * np.cos(angle), speed * np.sin(angle)]
    ids, truth, found = [], [], []
    for frame in range(frames):
        c = p + v * frame
        keep = r.random(n) < p_detect
        z = c[keep] + r.normal(0, 1.5, (keep.sum(), 2))
        k = r.poisson(clutter)
        z = np.r_[z, np.c_[r.uniform(0, 1920, k), r.uniform(0, 1080, k)]]
        z = z[r.permutation(len(z))]
        ids.append(np.arange(n))
        truth.append(np.c_[c - 20, np.full((n, 2), 40.0)])
        found.append(np.c_[z - 20, np.full((len(z), 2), 40.0), np.full(len(z), 0.9)])
    return Boxes(f"plain-{n}-{p_detect:g}-{clutter:g}", 30.0, (1920, 1080), ids, truth, found)


def walk(seed: int, *, seconds: float = 30.0) -> Boxes:
    """Returns one scene; frame rate, camera, number of people and detector are drawn from the seed."""
    r = np.random.default_rng(seed)
    fps = float(r.choice([7, 10, 14, 25, 30]))
    camera = float(r.uniform(1.6, 7.0)), float(r.uniform(5, 14)), float(r.uniform(500, 900))
    people = int(r.integers(4, 16))
    p_detect, clutter, jitter = r.uniform(0.8, 0.98), r.uniform(0.05, 0.6), r.uniform(0.02, 0.07)
    paths = _paths(r, people, int(seconds * fps), fps, camera)
    return _see(r, paths, fps, camera, p_detect, clutter, jitter, f"walk-{seed}")


def _paths(r, people, frames, fps, camera):
    """Returns ground positions (T, P, 2), m, of people, some in pairs, who turn at the edges."""
    half, near, far = 0.75 * camera[1], camera[1] * 0.6, camera[1] * 2.0
    p = np.c_[r.uniform(-half, half, people), r.uniform(near, far, people)]
    angle = np.where(r.random(people) < 0.6, r.choice([0.0, np.pi], people), r.uniform(0, 2 * np.pi, people))
    speed = np.clip(r.normal(1.25, 0.25, people), 0.3, 2.0) * (r.random(people) > 0.1)
    want = np.c_[speed * np.cos(angle), speed * np.sin(angle)]
    for i in range(1, people):
        if r.random() < 0.4:
            p[i], want[i] = p[i - 1] + r.normal(0, 0.2, 2) + [0.3, 0.6], want[i - 1]
    v, dt, path = want.copy(), 1 / fps, []
    for _ in range(frames):
        v += (want - v) * dt / 0.7 + r.normal(0, 0.35 * np.sqrt(dt), v.shape)
        p = p + v * dt
        for axis, (low, high) in enumerate(((-1.4 * half, 1.4 * half), (near, far))):
            out = ((p[:, axis] < low) & (want[:, axis] < 0)) | ((p[:, axis] > high) & (want[:, axis] > 0))
            want[out, axis] *= -1
        turn = r.random(people) < dt / 12
        want[turn] = want[turn] @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        path.append(p.copy())
    return np.array(path)


def _see(r, paths, fps, camera, p_detect, clutter, jitter, name):
    """Returns the true and detected boxes of the paths."""
    high, _, focal = camera
    people = paths.shape[1]
    tall, phase = r.normal(1.7, 0.08, people), r.uniform(0, 2 * np.pi, people)
    horizon = HEIGHT / 2 - focal * np.tan(np.arctan2(high, camera[1] * 1.1) * 0.8)
    post, swallow = (r.uniform(0.3, 0.7) * WIDTH if r.random() < 0.5 else None), r.uniform(0, 0.4)
    haunt = np.c_[r.uniform(0, WIDTH, 2), r.uniform(0.2, 0.6, 2) * HEIGHT]
    error, ghosts, lost = np.zeros((people, 4)), [], np.zeros(people, bool)
    memory, stay = np.exp(-1 / (fps * 0.15)), np.exp(-1 / (fps * 0.12))
    ids, truth, found = [], [], []
    for frame, p in enumerate(paths):
        depth = p[:, 1]
        foot, size = horizon + focal * high / depth, focal * tall / depth
        wide = size * (0.38 + 0.08 * np.sin(2 * np.pi * 0.9 * frame / fps + phase))
        box = np.c_[WIDTH / 2 + focal * p[:, 0] / depth - wide / 2, foot - size, wide, size]
        centre = box[:, :2] + box[:, 2:] / 2
        within = ((centre > 0) & (centre < [WIDTH, HEIGHT])).all(1)
        seen = _visible(box, depth)
        if post is not None:
            seen = seen * np.clip(np.abs(centre[:, 0] - post) / wide, 0.3, 1)
        lost = np.where(r.random(people) < stay, lost, r.random(people) > p_detect)
        error = memory * error + np.sqrt(1 - memory**2) * r.normal(0, jitter, (people, 4)) * [1, 1, 1.5, 1.5]
        hit = within & ~lost & (r.random(people) < np.clip((seen - 0.25) / 0.35, 0, 1))
        noisy = box + error * size[:, None]
        noisy[:, :2] -= noisy[:, 2:] / 2 - box[:, 2:] / 2
        noisy[:, 2:] = np.maximum(noisy[:, 2:], 4)
        score = np.clip(0.55 + 0.45 * seen + r.normal(0, 0.05, people), 0.3, 1)
        ghosts = [g for g in ghosts if r.random() > 1 / (fps * 0.2)] + _ghosts(r, clutter * 5 / fps, haunt, size)
        rows = _swallow(r, np.c_[noisy, score][hit], swallow)
        ids.append(np.flatnonzero(within) + 1)
        truth.append(box[within])
        found.append(_suppress(np.r_[rows, np.array(ghosts).reshape(-1, 5)]))
    return Boxes(name, fps, (int(WIDTH), int(HEIGHT)), ids, truth, found)


def _ghosts(r, rate, haunt, size):
    """Returns new false boxes: a third of them in the places where false boxes come back."""
    made = []
    for _ in range(r.poisson(rate)):
        side = r.uniform(0.7, 1.3) * np.median(size)
        place = np.r_[r.uniform(0, WIDTH), r.uniform(0, max(HEIGHT - side, 1.0))]
        if r.random() < 1 / 3:
            place = haunt[r.integers(2)] + r.normal(0, 0.04, 2) * side
        made.append(np.r_[place, 0.4 * side, side, r.uniform(0.5, 0.9)])
    return made


def _swallow(r, rows, chance):
    """Returns the boxes after some pairs that overlap much have become one box over both."""
    rows = list(rows)
    for i in range(len(rows) - 1, 0, -1):
        for j in range(i):
            if _iou(rows[i], rows[j]) > 0.2 and r.random() < chance * 0.5:
                low = np.minimum(rows[i][:2], rows[j][:2])
                high = np.maximum(rows[i][:2] + rows[i][2:4], rows[j][:2] + rows[j][2:4])
                rows[j] = np.r_[low, high - low, max(rows[i][4], rows[j][4])]
                del rows[i]
                break
    return np.array(rows).reshape(-1, 5)


def _visible(box, depth):
    """Returns the share of each box that no nearer box covers, on a grid of 12 x 12 points."""
    u = (np.arange(12) + 0.5) / 12
    grid = box[:, None, :2] + np.stack(np.meshgrid(u, u), -1).reshape(1, -1, 2) * box[:, None, 2:]
    covers = (
        (grid[:, :, None] > box[None, None, :, :2]) & (grid[:, :, None] < (box[:, :2] + box[:, 2:])[None, None])
    ).all(3)
    covers &= (depth[None] < depth[:, None])[:, None]
    return 1 - covers.any(2).mean(1)


def _suppress(rows, limit=0.6):
    """Returns the boxes that greedy non-maximum suppression by IoU leaves."""
    kept = []
    for row in rows[np.argsort(-rows[:, 4])]:
        if all(_iou(row, other) < limit for other in kept):
            kept.append(row)
    return np.array(kept).reshape(-1, 5)


def _iou(a, b):
    low, high = np.maximum(a[:2], b[:2]), np.minimum(a[:2] + a[2:4], b[:2] + b[2:4])
    shared = np.prod(np.maximum(high - low, 0))
    return shared / (a[2] * a[3] + b[2] * b[3] - shared)
