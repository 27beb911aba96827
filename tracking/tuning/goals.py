"""The goals of a search: scores of the catalogue, each with the direction that is better, and speed.

A goal turns one episode into one number, and many episodes into one mean.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest
from tracking.environment.episodes import Episode

SPEED = "frames/s"  # Key of the tracker's speed. It is the only goal that differs between two runs of the same episode.

# Scores that every episode has; other scores need the whole catalogue to be computed.
FAST_KEYS = ("objective", "HOTA", "group_F1")


@dataclass(frozen=True)
class Goal:
    """One score to improve."""

    key: str  # in the catalogue of scores, or "frames/s" for the tracker's speed
    higher: bool = True  # True if greater values are better

    def of(self, episode: Episode) -> float:
        """Returns the score of one episode, nan if the episode does not have it."""
        if self.key == SPEED:
            return episode.frames / episode.seconds_tracking if episode.seconds_tracking else float("nan")
        return episode.scores.get(self.key, float("nan"))

    def mean(self, episodes: Sequence[Episode]) -> float:
        """Returns the mean over the episodes that have the score, nan if none has."""
        if self.key == SPEED:
            seconds = sum(e.seconds_tracking for e in episodes)
            return sum(e.frames for e in episodes) / seconds if seconds else float("nan")
        return finite_mean(self.of(e) for e in episodes)

    def gain(self, before: float, after: float) -> float:
        """Returns by how much the value `after` is better than `before`, negative if worse, nan if one is nan."""
        return after - before if self.higher else before - after


def finite_mean(values: Iterable[float]) -> float:
    """Returns the mean of the values that are not nan, nan if there are none. Infinite values are kept."""
    known = [v for v in values if v == v]
    return sum(known) / len(known) if known else float("nan")


def goals_of(keys: Iterable[str]) -> tuple[Goal, ...]:
    """Returns one goal per key, in the order given; the catalogue of scores says which direction is better."""
    from tracking.scoring.catalogue import CATALOGUE

    found: list[Goal] = []
    allowed = [SPEED, *(key for key, score in CATALOGUE.items() if score.better != "neither")]
    for key in keys:
        if key not in allowed:
            remedy = f"did you mean {closest(key, allowed)}? docs/reference/metrics.md lists them"
            expected = f"a score with a better direction, or {SPEED}"
            raise InputError(place="--objective", got=key, expected=expected, remedy=remedy)
        if key in [goal.key for goal in found]:
            raise InputError(place="--objective", got=f"{key} twice", expected="each once", remedy="remove one")
        found.append(Goal(key, key == SPEED or CATALOGUE[key].better == "higher"))
    if not found:
        raise InputError(place="--objective", got="none", expected="a score", remedy="remove the option")
    return tuple(found)
