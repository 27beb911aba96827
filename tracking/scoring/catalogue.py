"""The catalogue of scores: key, unit, range, which direction is better, meaning and source of every score.

docs/reference/metrics.md has the table.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from sim.types import Array

CORE = "groups, core"
# Raise this whenever the same tracks and truth give another score; stored scores in the tests check that.
SCORER = 1

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

    def within(self, values: Array, difference: bool = False) -> Array:
        """Returns the values, ends of an interval, as clipped to the range of possible values. difference: True if they
        are ends of an interval of differences."""
        span = self.high - self.low
        return values.clip(-span, span) if difference else values.clip(self.low, self.high)


def _core(score: Score) -> Score:
    meaning = f"{score.key} without frames up to 1 s before or after the start of a true merge or split"
    return replace(score, key=f"{score.key}_core", family=CORE, meaning=meaning)


def _read() -> tuple[Score, ...]:
    """Returns the scores of catalogue.tsv, the core scores behind those of groups."""
    text = Path(__file__).with_name("catalogue.tsv").read_text(encoding="utf-8")
    rows: list[list[Any]] = [line.split("\t") for line in text.splitlines()[1:]]
    scores = []
    for key, family, unit, low, high, better, meaning, source in rows:
        scores.append(Score(key, family, unit, float(low), float(high), better, meaning, source))
    end = 1 + max(k for k, score in enumerate(scores) if score.family == "groups")
    return (*scores[:end], *(_core(score) for score in scores if score.family == "groups"), *scores[end:])


ALL = _read()
CATALOGUE = MappingProxyType({score.key: score for score in ALL})  # Every score by key, in display order.
