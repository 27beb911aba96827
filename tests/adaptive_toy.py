"""Trackers for tests of agents: the toy with a `reach` that may change between frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scenarios.errors import InputError
from sim.types import Context, Detections, Frame, Tracks
from tests.toy_tracker import Toy
from tracking.config import Config, param


@dataclass(frozen=True)
class ChangingConfig(Config):
    """`reach` is short: whoever hurries is somebody new in every frame."""

    tracker: ClassVar[str] = "changing"

    reach: float = param(0.15, (0.05, 5.0), "m", "nobody goes further in a frame", "log")
    skip: int = param(0, (0, 4), "people", "so many are left out", "int", online=False)


class Changing(Toy):
    """The toy, by the reach of the moment."""

    config_class = ChangingConfig

    def __init__(self, config: ChangingConfig) -> None:
        self.config = config


class Choosy(Changing):
    """Takes no other reach than the one it has begun with."""

    def reset(self, context: Context, seed: int) -> None:
        super().reset(context, seed)
        self.first = self.config

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        if self.config != self.first:
            raise InputError(place="reach", got="another", expected="the same", remedy="leave it")
        return super().step(frame, detections)


class Indifferent(Changing):
    """Does the same whatever the reach."""

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        kept, self.config = self.config, ChangingConfig()
        answer = super().step(frame, detections)
        self.config = kept
        return answer
