"""One entry of the catalogue of scores, and functions that make entries."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import Literal

Better = Literal["higher", "lower", "neither"]


@dataclass(frozen=True)
class Score:
    """One score of the catalogue."""

    key: str  # its name in the results, such as "HOTA"
    family: str  # name of the group of scores that are shown together, such as "people"
    # "1" for a share; "m | px" for a length in m on the ground or in px in the image ("m² | px²" squared); "m/s",
    # "count", "s", "people"
    unit: str
    # low, high: range of possible values; may be infinite
    low: float
    high: float
    better: Better  # whether "higher" or "lower" values are better, or "neither"
    meaning: str  # definition in words
    source: str = ""  # the paper that defines it, "" if flockscope does

    @property
    def best(self) -> float:
        """The value of a perfect tracker: `high` if higher is better, 0 if lower is better."""
        value = {"higher": self.high, "lower": 0.0, "neither": inf}[self.better]
        return value if value < inf else float("nan")


def share(key: str, meaning: str, low: float = 0.0) -> Score:
    """Returns a score of unit 1 from `low` to 1, higher is better, without family and source."""
    return Score(key, "", "1", low, 1.0, "higher", meaning)


def count(key: str, meaning: str, better: Better = "lower") -> Score:
    """Returns a number of 0 or more, without family and source."""
    return Score(key, "", "count", 0.0, inf, better, meaning)


def length(key: str, meaning: str, unit: str = "m | px") -> Score:
    """Returns an error of 0 or more in `unit`, lower is better, without family and source."""
    return Score(key, "", unit, 0.0, inf, "lower", meaning)


def in_family(family: str, *scores: Score) -> tuple[Score, ...]:
    """Returns the scores with the family `family`."""
    return tuple(replace(score, family=family) for score in scores)


def from_source(source: str, *scores: Score) -> tuple[Score, ...]:
    """Returns the scores with the source `source`."""
    return tuple(replace(score, source=source) for score in scores)
