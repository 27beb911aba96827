"""The least that a stranger's tracker must be: nearest neighbours, no groups, no events."""

from __future__ import annotations

import numpy as np

from sim.types import Context, Detections, Frame, Tracks

REACH = 1.0  # m


class Nearest:
    """State: the last place and id of everybody seen in the frame before, and the next free id."""

    needs = ("points", "boxes")

    def reset(self, context: Context, seed: int) -> None:
        self.fps, self.px_per_m = context.fps, context.px_per_m
        self.pos, self.id, self.next = np.zeros((0, 2)), np.zeros(0, np.int64), 0

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        found = detections if detections is not None else Detections(frame.index, frame.t, "ground", np.zeros((0, 2)))
        reach = REACH if found.plane == "ground" else REACH * self.px_per_m
        n, id, vel = len(found.pos), np.full(len(found.pos), -1), np.full((len(found.pos), 2), np.nan)
        apart = np.linalg.norm(found.pos[:, None] - self.pos[None], axis=2)
        while apart.size and apart.min() < reach:
            row, before = np.unravel_index(apart.argmin(), apart.shape)
            id[row] = self.id[before]
            apart[row], apart[:, before] = np.inf, np.inf
        born = id < 0
        id[born] = self.next + np.arange(born.sum())
        self.pos, self.id, self.next = found.pos, id, self.next + int(born.sum())
        alone, cov = np.full(n, -1), np.tile(np.eye(4), (n, 1, 1))
        return Tracks(frame.index, frame.t, found.plane, "person", id, alone, found.pos, vel, cov, found.box)


class OneGroup(Nearest):
    """All people are one group."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        found = super().step(frame, detections)
        return found.replace(group=0 * found.id)


class Crashes(Nearest):
    """Raises in the first frame."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        raise ValueError("no")
