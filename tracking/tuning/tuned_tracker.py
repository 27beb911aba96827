"""What is tuned: a tracker, by name, file or class; or the baseline rule of groups, by the name `grouping`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from scenarios.errors import InputError
from sim.types import DetectionMode, Tracker
from tracking.config import Config
from tracking.environment.episodes import Cache, Episode, Source, play, streams_for
from tracking.grouping.link_rule import LinkRule

RULE = LinkRule.tracker


@dataclass(frozen=True)
class Subject:
    """A tracker with parameters: as `tracking.track` takes it, what it is called, its config's class, what it needs, a
    hash of the file that it is from."""

    tracker: str | type[Tracker]
    name: str
    config_class: type[Config]
    needs: tuple[str, ...]
    code: str = ""

    @property
    def objective(self) -> str:
        """What it is tuned for where nothing is said."""
        return "pairwise_F1" if self.name == RULE else "objective"

    @property
    def detections(self) -> DetectionMode:
        """What it is given where nothing is said: no pictures unless it takes nothing else, as they cost most; the
        rule of groups people who are who they are."""
        if self.name == RULE:
            return "truth"
        return "file" if {"boxes", "points"} & {*self.needs} else "image"

    def accept(self, source: Source, detections: DetectionMode) -> None:
        """InputError where it cannot work on such a source."""
        from tracking.detection_mode import choose_mode

        if self.name == RULE:
            if detections != "truth":
                remedy = "leave the option out: the rule is tuned on people whose identity is known"
                raise InputError(place="--detections", got=detections, expected="truth", remedy=remedy)
            return
        choose_mode(self.needs, source.open(streams_for(self.tracker, detections)), detections)

    def play(
        self, source: Source, values: dict[str, Any], detections: DetectionMode, cache: Cache, every_score: bool
    ) -> Episode:
        """One episode with these parameters; a tracker that draws does so by the source's seed."""
        if self.name == RULE:
            from tracking.tuning.grouping_episodes import play_rule

            return play_rule(source, LinkRule.from_dict(values), cache)
        return play(
            self.tracker, source, values, detections=detections, tracker_seed=source.seed, cache=cache,
            every_score=every_score,
        )  # fmt: skip


def subject_of(tracker: str | type[Tracker]) -> Subject:
    """The subject of this name, file or class; InputError where it is no tracker or has no parameters."""
    from tracking.tracker_registry import checked, code_hash, config_class, find

    if tracker == RULE:
        return Subject(RULE, RULE, LinkRule, ("points", "boxes"))
    named = tracker if isinstance(tracker, str) else getattr(tracker, "__name__", str(tracker))
    found: Any = find(tracker) if isinstance(tracker, str) else checked(tracker, named)
    return Subject(tracker, named, config_class(found, named), tuple(found.needs), code_hash(found))
