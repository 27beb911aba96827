"""What a report shows, whatever it was made from: stored runs (`view`) or a sweep (`stress`)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any

import numpy as np

from tracking.errors.found import CauseRow
from tracking.stats import mean_of_finite

Json = dict[str, Any]


@dataclass(frozen=True)
class Played:
    """One run of a tracker on one sequence, with its score."""

    name: str
    scenario: str
    scene: str  # scenario and seed, the same at all values of the axes of a sweep
    sequence: str
    score: float  # nan where unknown
    best: float  # the oracle's score, nan without one
    why: str = ""  # why it cannot be shown
    command: str = ""  # generates the sequence, "" for a given one

    @property
    def shortfall(self) -> float:
        """The oracle's score minus the run's; 1 minus the run's score if the oracle's is unknown."""
        return (1.0 if math.isnan(self.best) else self.best) - self.score


@dataclass(frozen=True)
class HeatCell:
    """A tracker's mean score in one scenario."""

    score: float
    best: float  # the oracle's, nan without one
    why: str = ""  # why it is empty
    side: str = ""  # of the limit, in words: "above", "below" or "unknown"; "" if there is no limit
    edges: str = ""  # classes of the sides at which the frontier lies: "left", "top"

    @property
    def share(self) -> float:
        """The score as a share of the oracle's, nan without one."""
        return self.score / self.best if self.best > 0 else math.nan


@dataclass(frozen=True)
class HeatMap:
    """Scores of trackers (columns) by scenario, or by values of two axes (rows)."""

    title: str
    columns: SequenceOf[str]
    rows: Mapping[str, SequenceOf[HeatCell]]


def heat_map(title: str, played: Iterable[tuple[str, str, Played]]) -> HeatMap:
    """Returns the mean score of each cell. played: for each run the names of its row and column, and the run; rows and
    columns are in order of first occurrence."""
    found: dict[str, dict[str, list[Played]]] = {}
    for row, column, one in played:
        found.setdefault(row, {}).setdefault(column, []).append(one)
    columns = list(dict.fromkeys(column for row in found.values() for column in row))
    rows = {name: [_cell(row.get(column, [])) for column in columns] for name, row in found.items()}
    return HeatMap(title, columns, rows)


def _cell(found: SequenceOf[Played]) -> HeatCell:
    known = [one for one in found if math.isfinite(one.score)]
    score, best = (mean_of_finite(np.array(part)) for part in ([p.score for p in known], [p.best for p in known]))
    why = " or ".join(sorted({one.why for one in found}))
    return HeatCell(score, best, "" if math.isfinite(score) else why)


@dataclass(frozen=True)
class Curves:
    """The curves of all trackers over one axis."""

    axis: str
    about: str
    values: SequenceOf[float]
    curves: Mapping[str, Json]  # by tracker or oracle, as in stress.json: mean, low and high by value, breaking point
    shares: Mapping[str, Json]  # the same of the share of the oracle, by tracker
    words: SequenceOf[str]  # breaking points in words


@dataclass(frozen=True)
class Moment:
    """A part of a sequence around the costliest error of a run, with its replay."""

    run: Played
    start: float  # s
    kind: str  # of the dearest error, "" without one
    words: str
    replay: str | None  # page data as text for a script element; None: it was left out


@dataclass(frozen=True)
class Opening:
    """The replay with which a report opens."""

    words: str
    page: str  # HTML of its page
    address: str  # of the same replay as a page of its own


@dataclass(frozen=True)
class Report:
    """The whole content of a report; parts that are empty or None are not shown."""

    title: str
    about: str
    by: str
    ranking: SequenceOf[Json]  # run, rank in words ("" of an oracle), mean, low, high, and means of other scores by key
    ranking_words: SequenceOf[str] = ()
    heat: HeatMap | None = None
    curves: Curves | None = None
    matrices: SequenceOf[HeatMap] = ()
    matrix_words: SequenceOf[str] = ()
    causes: SequenceOf[tuple[str, CauseRow]] = ()  # tracker, and what a kind and cause of errors costs it
    causes_about: str = ""
    moments: SequenceOf[Moment] = ()
    failures: SequenceOf[Json] = ()  # episodes that a tracker could not finish, as in stress.json
    sequences: SequenceOf[tuple[str, str, float]] = ()  # name, address of its page, score: worst first
    opening: Opening | None = None
