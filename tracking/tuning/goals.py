"""What is tuned for: scores of the catalogue, each in its own direction, and speed; one number for many episodes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest
from tracking.environment.episodes import Episode

SPEED = "frames/s"
"""Frames per second in the tracker; the one goal that is not the same every time."""

ALWAYS = ("objective", "HOTA", "group_F1_hull")
"""Keys that an episode has without computing the whole catalogue."""


@dataclass(frozen=True)
class Goal:
    """A score and whether more of it is better."""

    key: str
    higher: bool = True

    def of(self, episode: Episode) -> float:
        """What one episode reached; nan where it is not known (nothing to divide by)."""
        if self.key == SPEED:
            return episode.frames / episode.seconds_tracking if episode.seconds_tracking else float("nan")
        return episode.scores.get(self.key, float("nan"))

    def mean(self, episodes: Sequence[Episode]) -> float:
        """What many reached: the mean of those where it is known, nan if of none; frames over seconds for speed."""
        if self.key == SPEED:
            seconds = sum(e.seconds_tracking for e in episodes)
            return sum(e.frames for e in episodes) / seconds if seconds else float("nan")
        return mean(self.of(e) for e in episodes)

    def gain(self, before: float, after: float) -> float:
        """How much better the second is."""
        return after - before if self.higher else before - after


def mean(values: Iterable[float]) -> float:
    """The mean of the known ones, nan if there are none."""
    known = [v for v in values if v == v]
    return sum(known) / len(known) if known else float("nan")


def goals(keys: Iterable[str]) -> tuple[Goal, ...]:
    """The goals of these keys; InputError for an unknown one, for one of which neither way is better, for a double."""
    from tracking.scoring.catalogue import CATALOGUE

    found: list[Goal] = []
    able = [SPEED, *(key for key, score in CATALOGUE.items() if score.better != "neither")]
    for key in keys:
        if key not in able:
            remedy = f"did you mean {closest(key, able)}? docs/metrics.md lists them"
            raise InputError(
                place="--objective", got=key, expected=f"a score with a better side, or {SPEED}", remedy=remedy
            )
        if key in [goal.key for goal in found]:
            raise InputError(place="--objective", got=f"{key} twice", expected="each once", remedy="leave one out")
        found.append(Goal(key, key == SPEED or CATALOGUE[key].better == "higher"))
    if not found:
        raise InputError(place="--objective", got="none", expected="a score", remedy="leave the option out")
    return tuple(found)
