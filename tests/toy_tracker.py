"""A nearest-neighbour tracker for tests of tuning. Its default `reach` is far too short; a search should find that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from scenarios.errors import InputError
from sim.types import Context, Detections, Frame, Tracks
from tracking.config import Config, param


@dataclass(frozen=True)
class ToyConfig(Config):
    """With the default `reach` every detection starts a new track in every frame."""

    tracker: ClassVar[str] = "toy"

    reach: float = param(0.1, (0.05, 5.0), "m", "greatest step of a person between frames", "log")
    skip: int = param(0, (0, 4), "people", "number of detections that are ignored", "int")
    colour: str = param("red", ("red", "green"), "", "has no effect", "categorical")
    forbidden: float = param(0.0, (0.0, 1.0), "", "must stay below 0.5")
    steps: float = param(1.0, (0.0, 2.0), "", "has no effect; for a detector in pictures", sees="pixels")

    def check(self) -> None:
        """Refuses values of `forbidden` above 0.5."""
        if self.forbidden > 0.5:
            raise InputError(place="forbidden", got=self.forbidden, expected="under 0.5", remedy="take less")


class Toy:
    """State: positions and ids of the tracks of the last frame, and the next free id."""

    needs = ("points", "boxes")
    config_class = ToyConfig

    def __init__(self, config: ToyConfig) -> None:
        self.config = config

    def reset(self, context: Context, seed: int) -> None:
        self.fps = context.fps
        self.pos, self.id, self.next = np.zeros((0, 2)), np.zeros(0, np.int64), 0

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        pos = detections.pos[self.config.skip :]
        n, id, vel = len(pos), np.full(len(pos), -1), np.zeros((len(pos), 2))
        apart = np.linalg.norm(pos[:, None] - self.pos[None], axis=2)
        while apart.size and apart.min() < self.config.reach:
            row, before = np.unravel_index(apart.argmin(), apart.shape)
            id[row], vel[row] = self.id[before], (pos[row] - self.pos[before]) * self.fps
            apart[row], apart[:, before] = np.inf, np.inf
        born = id < 0
        id[born] = self.next + np.arange(born.sum())
        self.pos, self.id, self.next = pos, id, self.next + int(born.sum())
        cov = np.tile(np.eye(4), (n, 1, 1))
        return Tracks(frame.index, frame.t, detections.plane, "person", id, np.full(n, -1), pos, vel, cov)


class BoxedToy(Toy):
    """Reports the boxes in the image, as detectors have them; they are compared where they stand on the ground."""

    needs = ("boxes",)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        found, box = super().step(frame, detections), detections.box[self.config.skip :]
        return found.replace(
            plane="image", pos=box[:, :2] + box[:, 2:] / 2, box=box, vel=np.full((len(box), 2), np.nan)
        )
