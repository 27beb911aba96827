"""`Follower`: a tracker of a few lines with three parameters, which stands for one that nobody has tuned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.optimize import linear_sum_assignment

from sim.types import Context, Detections, Frame, Tracks
from tracking.config import Config, param


@dataclass(frozen=True)
class FollowerConfig(Config):
    """Parameters of `Follower`."""

    tracker: ClassVar[str] = "follower"
    reach: float = param(1.0, (0.1, 5.0), "m", "greatest distance from where a track is expected", "log")
    patience: float = param(0.0, (0.0, 4.0), "s", "time for which a track waits for its next detection")
    least_score: float = param(0.0, (0.0, 1.0), "", "detections with a lower score are left out")


class Follower:
    """Gives each detection to the track that is expected nearest to it if it goes on as before."""

    needs = ("boxes", "points")
    config_class = FollowerConfig

    def __init__(self, config: FollowerConfig) -> None:
        self.config = config

    def reset(self, context: Context, seed: int) -> None:
        """Forgets all tracks."""
        self.wait, self.px_per_m = self.config.patience + 1.5 / context.fps, context.px_per_m
        self.id, self.seen, self.next_id = np.zeros(0, np.int64), np.zeros(0), 0
        self.pos, self.vel = np.zeros((0, 2)), np.zeros((0, 2))

    def step(self, frame: Frame, detections: Detections) -> Tracks:
        """Returns a track for each detection."""
        kept = detections.score >= self.config.least_score
        pos, box = detections.pos[kept], None if detections.box is None else detections.box[kept]
        reach = self.config.reach * (1.0 if detections.plane == "ground" else self.px_per_m)
        waiting = frame.t - self.seen <= self.wait
        old_id, seen, old, vel = (x[waiting] for x in (self.id, self.seen, self.pos, self.vel))
        gone = (frame.t - seen)[:, None]
        distance = np.linalg.norm(pos[:, None] - (old + gone * vel)[None], axis=2)
        new, at = linear_sum_assignment(np.minimum(distance, reach))
        near = distance[new, at] < reach
        new, at = new[near], at[near]
        id = self.next_id + np.arange(len(pos))
        self.next_id += len(id)
        moved = np.zeros((len(id), 2))
        id[new], moved[new] = old_id[at], (pos[new] - old[at]) / gone[at]
        lost = np.delete(np.arange(len(old)), at)
        self.id, self.seen = np.append(id, old_id[lost]), np.append(np.full(len(id), frame.t), seen[lost])
        self.pos, self.vel = np.vstack([pos, old[lost]]), np.vstack([moved, vel[lost]])
        alone, cov = np.full(len(id), -1), np.tile(np.eye(4), (len(id), 1, 1))
        return Tracks(frame.index, frame.t, detections.plane, "person", id, alone, pos, moved, cov, box)
