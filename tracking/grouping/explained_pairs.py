"""Why two people are taken as together: the belief of each pair and step, divided into its quantities.

The log-odds of *now* are the bias at the noise of the row, the sum of all tables, and what the share of mates seen so
far adds (`SHARE`). `explain` sums the tables of each quantity over the times of its means, as these tables are fitted
together and only their sum has a meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sim.hashing import canonical_hash
from sim.types import Array, Ints
from tracking.grouping.belief import Belief
from tracking.grouping.mate_share import MateShare
from tracking.grouping.pair_evidence import NAMES, evidence
from tracking.grouping.person_motion import frames_per_step, step_rows
from tracking.grouping.tracks_table import TracksTable

# Columns of `ExplainedPairs.values`: what the two do now, over 0.8 s, and what they did lately.
VALUES = (
    "distance, 0.8 s", "sideways, 0.8 s", "lengthwise, 0.8 s", "velocity difference, 0.8 s", "growth, 5 s", "turn, 5 s",
    "one walks, 5 s", "file, 5 s", "pace, 1.5 s", "offset in noise, 5 s", "velocity difference in noise, 4 s",
)  # fmt: skip
SHARE = "share of mates"  # Name of a term.


@dataclass(frozen=True, slots=True, eq=False)
class ExplainedPairs:
    """R rows of pairs of people, one per pair and step in which both were seen less than 4 m apart, sorted by pair,
    then step."""

    belief: Belief
    ids: Ints  # (P,): of the people
    people: str  # hash of who is where and when, in cm
    length: int  # frames of the sequence
    size: int  # frames per step
    fps: float
    step: Ints  # (R,): from 0; a step begins with frame step * size, counted from 0
    # a, b (R,): ids, a < b; pair (R,): number of the pair, from 0, ascending
    a: Ints
    b: Ints
    pair: Ints
    log_odds: Array  # (R,): of being together now
    quantities: tuple[str, ...]  # Q names
    terms: np.ndarray  # (R, Q), float32: the parts of `log_odds` beside the bias
    values: np.ndarray  # (R, len(VALUES)), float32, nan if unknown
    noise: Array  # (R,): of the two people's positions, m
    bias: Array  # (R,): log-odds before any evidence, at this noise
    threshold: Array  # (R,): probability above which the two are together

    @property
    def seconds(self) -> float:
        """Length of a step, s."""
        return self.size / self.fps

    @property
    def probability(self) -> Array:
        """Probability (R,) that the two are together now."""
        return np.asarray(1 / (1 + np.exp(-self.log_odds)))

    def take(self, rows: Ints) -> ExplainedPairs:
        """Returns the rows with the indices `rows`, ascending; pairs keep their numbers."""
        names = ("step", "a", "b", "pair", "log_odds", "terms", "values", "noise", "bias", "threshold")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


def explain(table: TracksTable, fps: float, belief: Belief) -> ExplainedPairs:
    """Returns the evidence about all pairs of people. People who are predicted only are no evidence."""
    seen = slice(None) if table.seen is None else table.seen
    frame, column, pos = table.frame[seen], table.column[seen], table.pos[seen]
    size, shown = frames_per_step(fps), [NAMES.index(name) for name in VALUES]
    parts = quantity_parts(belief)
    found, share = list[Any](), MateShare(belief.share)
    for rows in evidence(step_rows(frame, column, pos, table.length, fps), size / fps):
        whole = belief.log_odds(rows.values, rows.noise)[:, 0]
        shift = share.add(rows.step, rows.pair, whole)
        terms = np.column_stack([*(p.log_odds(rows.values, rows.noise)[:, 0] for p in parts.values()), shift])
        bias, least = (np.interp(rows.noise, belief.noise, x) for x in (belief.bias[0], belief.threshold))
        numbers = (terms.astype(np.float32), rows.values[:, shown].astype(np.float32), rows.noise, bias, least)
        found.append((rows.step, rows.a, rows.b, whole + shift, *numbers))
    none, quantities = np.zeros(0, np.int64), (*parts, SHARE)
    tables = (np.zeros((0, len(quantities)), np.float32), np.zeros((0, len(VALUES)), np.float32))
    empty = (none, none, none, np.zeros(0), *tables, *[np.zeros(0)] * 3)
    columns = [np.concatenate(x) for x in zip(*(found or [empty]), strict=True)]
    order = np.lexsort((columns[0], columns[2], columns[1]))
    step, a, b, log_odds, terms, values, noise, bias, least = (x[order] for x in columns)
    pair = np.cumsum(np.append(False, (np.diff(a) != 0) | (np.diff(b) != 0)))[: len(a)]
    where = np.where(np.isfinite(table.pos), np.rint(100 * table.pos), -1).astype(np.int64)
    people = canonical_hash(("people", float(fps), table.length, table.frame, table.id, where))
    return ExplainedPairs(
        belief, table.ids, people, table.length, size, fps, step, table.ids[a], table.ids[b], pair, log_odds,
        quantities, terms, values, noise, bias, least,
    )  # fmt: skip


def quantity_parts(belief: Belief) -> dict[str, Belief]:
    """Returns by quantity, such as "distance", the belief of its tables alone, without bias. Quantities that tell
    nothing about now are left out."""
    names = dict.fromkeys(quantity_of(table.name) for table in belief.tables if table.log_odds[0].any())
    return {
        name: replace(
            belief, bias=np.zeros_like(belief.bias),
            tables=tuple(table for table in belief.tables if quantity_of(table.name) == name),
        ) for name in names
    }  # fmt: skip


def quantity_of(table: str) -> str:
    """Returns the quantity of a table's name "quantity, time"."""
    return table.partition(",")[0]
