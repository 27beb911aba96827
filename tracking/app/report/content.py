"""What a report shows, whatever it was made from: stored runs (`view`) or a sweep (`stress`)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any

Json = dict[str, Any]


@dataclass(frozen=True)
class RankedRow:
    """A row of the ranking; a row without ranks is an oracle's."""

    name: str
    rank: str  # range of ranks in words, "" of an oracle
    mean: float
    low: float
    high: float
    scores: Mapping[str, float]  # means of other scores, nan where unknown


@dataclass(frozen=True)
class HeatCell:
    """A tracker's mean score in one scenario."""

    score: float
    best: float  # the oracle's, nan without one
    why: str = ""  # why it is empty

    @property
    def share(self) -> float:
        """The score as a share of the oracle's, nan without one."""
        return self.score / self.best if self.best > 0 else math.nan


@dataclass(frozen=True)
class HeatMap:
    """Scores of trackers (columns) by scenario, or by values of two axes (rows)."""

    title: str
    columns: tuple[str, ...]
    rows: Mapping[str, SequenceOf[HeatCell]]


@dataclass(frozen=True)
class Curve:
    """A tracker's score over an axis of difficulty, with 95 % intervals, and where it breaks."""

    name: str
    mean: SequenceOf[float]
    low: SequenceOf[float]
    high: SequenceOf[float]
    breaks: Mapping[str, float | None]  # at, low, high: values of the axis


@dataclass(frozen=True)
class Curves:
    """The curves of all trackers over one axis."""

    axis: str
    about: str
    values: SequenceOf[float]
    curves: SequenceOf[Curve]
    words: SequenceOf[str]  # breaking points in words


@dataclass(frozen=True)
class CauseBar:
    """What the repair of the errors of one kind and cause adds to a tracker's scores, mean over sequences."""

    name: str
    kind: str
    cause: str
    errors: int
    seconds: float
    gains: Mapping[str, float]  # HOTA, group_F1


@dataclass(frozen=True)
class Moment:
    """A stretch of a sequence in which a tracker is bad, with its replay."""

    name: str
    scenario: str
    sequence: str
    score: float
    best: float  # the oracle's score, nan without one
    start: float  # s
    kind: str  # of the dearest error, "" without one
    words: str
    replay: str | None  # page data as text for a script element; None: it was left out
    command: str = ""  # generates the sequence, "" for a given one


@dataclass(frozen=True)
class Failure:
    """An episode that a tracker could not finish."""

    name: str
    scene: str
    line: str
    traceback: str = ""


@dataclass(frozen=True)
class Report:
    """All that a report shows."""

    title: str
    about: str
    by: str
    ranking: SequenceOf[RankedRow]
    ranking_words: SequenceOf[str] = ()
    heat: HeatMap | None = None
    curves: SequenceOf[Curves] = ()
    matrices: SequenceOf[HeatMap] = ()
    causes: SequenceOf[CauseBar] = ()
    causes_about: str = ""
    moments: SequenceOf[Moment] = ()
    failures: SequenceOf[Failure] = ()
    sequences: SequenceOf[tuple[str, str, float]] = ()  # name, address of its page, score: worst first
