"""What is tuned: a tracker, by name, file or class."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scenarios.errors import InputError
from sim.types import DetectionMode, Tracker
from tracking.config import Config
from tracking.episodes import Cache, Episode, Source, play, streams_for


@dataclass(frozen=True)
class Subject:
    """A tracker with parameters: as `tracking.track` takes it, what it is called, its config's class, what it needs."""

    tracker: str | type[Tracker]
    name: str
    config_class: type[Config]
    needs: tuple[str, ...]

    @property
    def detections(self) -> DetectionMode:
        """What it is given where nothing is said: no pictures unless it takes nothing else, as they cost most."""
        return "file" if {"boxes", "points"} & {*self.needs} else "image"

    def accept(self, source: Source, detections: DetectionMode) -> None:
        """InputError where it cannot work on such a source."""
        from tracking.protocol import choose_mode

        choose_mode(self.needs, source.open(streams_for(self.tracker, detections)), detections)

    def play(
        self, source: Source, values: dict[str, Any], detections: DetectionMode, cache: Cache, every_score: bool
    ) -> Episode:
        """One episode with these parameters."""
        return play(
            self.tracker, source, values, detections=detections, cache=cache, every_score=every_score,
        )  # fmt: skip


def subject_of(tracker: str | type[Tracker]) -> Subject:
    """The subject of this name, file or class; InputError where it is no tracker or has no parameters."""
    from tracking.protocol import checked, find

    named = tracker if isinstance(tracker, str) else getattr(tracker, "__name__", str(tracker))
    found: Any = find(tracker) if isinstance(tracker, str) else checked(tracker, named)
    kind = getattr(found, "config_class", None)
    if kind is None:
        remedy = "give the class a config_class that declares them (docs/trackers.md)"
        raise InputError(place="tracker", got=named, expected="a tracker with parameters", remedy=remedy)
    return Subject(tracker, named, kind, tuple(found.needs))
