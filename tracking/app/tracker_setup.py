"""A tracker with its parameters and inputs, as a command runs it on sequences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sim.types import DetectionMode, Sequence
from tracking.config import Config
from tracking.grouping.grouping_choice import Grouping
from tracking.running.policy import Policy
from tracking.running.run import TrackingRun
from tracking.running.time_limit import TimeLimited


@dataclass(frozen=True)
class TrackerSetup:
    """A tracker with its parameters and inputs, as `tracking.track` takes them."""

    tracker: str
    config: Config | Policy | None = None
    detections: DetectionMode | None = None
    sensor: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    grouping: Grouping | None = None
    limited: TimeLimited | None = None  # the tracker with a limit of time for each step
    mask: str | None = None  # the region of the image that counts

    def run(
        self, sequence: Sequence, progress: Callable[[int], None] | None = None,
        if_stopped: Callable[[TrackingRun], None] | None = None,
    ) -> TrackingRun:  # fmt: skip
        """Tracks the sequence and returns its tracks, with groups and events. Nothing is written. if_stopped: as of
        `tracking.track`."""
        from tracking.running.run import track

        return track(
            self.limited or self.tracker, sequence, params=self.config, detections=self.detections,
            sensor=self.sensor, seed=self.seed, grouping=self.grouping, mask=self.mask, progress=progress,
            if_stopped=if_stopped,
        )  # fmt: skip
