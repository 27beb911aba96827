"""What a search tunes, and a sweep plays: a tracker by name, file or class, or the rule of groups, named `grouping`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

from scenarios.errors import InputError
from sim.types import DetectionMode, Tracker
from tracking.config import Config
from tracking.episodes.episode import Source, streams_for
from tracking.grouping.link_rule import LinkRule
from tracking.running.time_limit import TimeLimited
from tracking.running.tracker_registry import config_class, find, located
from tracking.running.used_files import code_of, folder_of
from tracking.scoring.people import Similarity

RULE = LinkRule.tracker


@dataclass(frozen=True)
class TunedTracker:
    """A tracker, or the baseline rule of groups, as a search tunes it and a sweep plays it."""

    tracker: str | type[Tracker]  # as `tracking.track` takes it, or "grouping" for the rule
    name: str
    needs: tuple[str, ...]
    code: str = ""  # as `used_files.code_of`
    folder: str = ""  # of the file that defines it
    objective: str = "objective"  # key of the score that it is tuned for by default
    detections: DetectionMode = "file"  # its input by default
    step_timeout: float | None = None  # seconds that each `reset` and `step` may take; never for a class and the rule

    @property
    def config_class(self) -> type[Config]:
        """The tracker's config class, `LinkRule` for the rule. Raises InputError if the tracker has no parameters."""
        if self.name == RULE:
            return LinkRule
        return config_class(find(self.tracker), self.name)

    def check_input(self, source: Source, detections: DetectionMode, similarity: Similarity | None) -> None:
        """Raises InputError if the tracker cannot work on this source with these detections and this similarity."""
        from tracking.running.detection_mode import choose_mode

        rule = self.name == RULE
        known: tuple[object, ...] = (None,) if rule else (None, *get_args(Similarity))
        if rule and detections != "truth":
            remedy = "remove the option: the rule is tuned on people whose identity is known"
            raise InputError(place="--detections", got=detections, expected="truth", remedy=remedy)
        if similarity not in known:
            expected = ", ".join(map(str, known))
            raise InputError(place="--similarity", got=similarity, expected=expected, remedy="correct or remove it")
        if not rule:
            choose_mode(self.needs, source.open(streams_for(self.tracker, detections)), detections)


def tuned_tracker(tracker: str | type[Tracker], step_timeout: float | None = None) -> TunedTracker:
    """Returns the tracker that is to be tuned, given by name, file or class; "grouping" is the baseline rule of groups.
    step_timeout: seconds that each `reset` and `step` may take, None for no limit; the rule takes None only."""
    if tracker == RULE:
        if step_timeout is not None:
            remedy = "leave it out: the rule has no steps"
            raise InputError(place="--step-timeout", got=step_timeout, expected="a tracker", remedy=remedy)
        return TunedTracker(RULE, RULE, ("points", "boxes"), objective="pairwise_F1", detections="truth")
    found = find(tracker)
    name, spec = (tracker, located(tracker)) if isinstance(tracker, str) else (found.__name__, found)
    if step_timeout is not None:
        TimeLimited(spec, step_timeout)  # refuses a class, and a wrong limit
    mode: DetectionMode = "file" if {"boxes", "points"} & {*found.needs} else "image"
    code, folder = code_of(found), folder_of(found)
    return TunedTracker(spec, name, tuple(found.needs), code, folder, detections=mode, step_timeout=step_timeout)
