"""The beliefs about all pairs of tracked people, step by step, and their probabilities in frames.

`BeliefHistory` adds frames one after another, and nothing in it looks ahead: it does not matter how many are added at
once. `beliefs_of_tracks` and `pair_probabilities` add all frames of a sequence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from sim.truth.merge_split_rules import frames_of, runs
from sim.types import Array, Bools, Ints
from tracking.grouping.belief import Belief
from tracking.grouping.mate_share import MateShare
from tracking.grouping.pair_evidence import PairHistory, PairRows
from tracking.grouping.person_motion import TIMES, Motion, StepRows, frames_per_step, new_places, step_rows, taken
from tracking.grouping.tracks_table import TracksTable


@dataclass(frozen=True, slots=True, eq=False)
class PairBeliefs:
    """Log-odds that two people belong together, one row per pair and step in which they were seen within 4 m,
    and per step in which they are missed after it."""

    step: Ints  # (R,): from 0, ascending
    # a, b (R,): columns, a < b; log_odds (R, 2): for `DECISIONS`
    a: Ints
    b: Ints
    log_odds: Array
    noise: Array  # (R,): of positions, m
    missed: Bools  # (R,): True where not both were seen, and the pair keeps its last log-odds

    def take(self, rows: Bools | Ints) -> PairBeliefs:
        """Returns some of the rows."""
        return PairBeliefs(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True, slots=True, eq=False)
class StepBeliefs:
    """What is known of some steps in a row: people who were seen, their motion, and the beliefs about pairs."""

    first: int  # the steps are first … end - 1
    end: int
    seen: StepRows
    motion: Motion
    pairs: PairBeliefs


class BeliefHistory:
    """The beliefs about all pairs of people so far.

    Until both of a pair are measured again, the pair keeps its last log-odds: for as long as both are reported, and
    `memory` seconds longer.

    State: pairs, their evidence; share, of mates among them; kept, the last beliefs; steps, number of complete ones;
    frame, column, pos, seen: rows of the step that is not complete.
    """

    def __init__(self, fps: float, belief: Belief) -> None:
        self.fps, self.belief, self.size = fps, belief, frames_per_step(fps)
        self.share, self.kept = MateShare(belief.share), _KeptBeliefs()
        self.pairs = PairHistory(self.size / fps, self.share, self.kept)
        self.steps = 0
        self.frame, self.column = np.zeros((2, 0), np.int64)
        self.pos, self.seen = np.zeros((0, 2)), np.zeros(0, bool)

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, as `PairHistory.take_people`."""
        place = new_places(rows, self.pairs.people)
        self.column = place[self.column]
        self.pairs.take_people(rows)

    def add(self, frame: Ints, column: Ints, pos: Array, seen: Bools, end: int) -> StepBeliefs:
        """Adds the frames up to `end`, and returns what follows for the steps that are complete now.

        frame, column (R,), from 0, pos (R, 2), m: frame, number of the person, and position of each person and frame.
        seen (R,): False in rows of people who are predicted only, which are no evidence.
        """
        frame, column = np.append(self.frame, frame), np.append(self.column, column)
        pos, seen = np.concatenate([self.pos, pos]), np.append(self.seen, seen)
        first, self.steps = self.steps, -(-end // self.size)
        step = -(-frame // self.size)
        late = step >= self.steps
        self.frame, self.column, self.pos, self.seen = frame[late], column[late], pos[late], seen[late]
        if first == self.steps:
            return StepBeliefs(first, first, *_NO_STEPS, _nothing())
        known = step_rows(frame[seen], column[seen], pos[seen], end, self.fps)
        motion, evidence = self.pairs.add(known)
        found = self._judged(evidence)
        reported = np.zeros((self.steps - first, self.pairs.people), bool)
        measured = np.zeros_like(reported)
        reported[step[~late] - first, column[~late]] = True
        measured[known.step - first, known.column] = True
        memory = frames_of(self.belief.memory * self.fps / self.size, 1.0)
        missed = self.kept.add(self.pairs, first, found, measured, reported, memory)
        both = _joined([found, missed])
        return StepBeliefs(first, self.steps, known, motion, both.take(np.argsort(both.step, kind="stable")))

    def _judged(self, evidence: Iterator[PairRows]) -> PairBeliefs:
        found = [_nothing()]
        for rows in evidence:
            log_odds = self.belief.log_odds(rows.values, rows.noise)
            log_odds[:, 0] += self.share.add(rows.step, rows.pair, log_odds[:, 0])
            found.append(PairBeliefs(rows.step, rows.a, rows.b, log_odds, rows.noise, np.zeros(len(rows.step), bool)))
        return _joined(found)


class _KeptBeliefs:
    """The last belief about each of P pairs. State: gone (P,), as of `belief_kernels.keep_missed`; log_odds (P, 2);
    noise (P,)."""

    def __init__(self) -> None:
        self.gone, self.log_odds, self.noise = np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(0)

    def take(self, rows: Ints) -> None:
        """Renumbers the pairs, as `Follower.take`."""
        self.gone, self.log_odds = taken(self.gone, rows, -2), taken(self.log_odds, rows, 0.0)
        self.noise = taken(self.noise, rows, 0.0)

    def add(
        self, pairs: PairHistory, first: int, found: PairBeliefs, seen: Bools, reported: Bools, memory: int
    ) -> PairBeliefs:
        """Adds the beliefs of steps from `first` on, and returns rows for the steps in which one of a pair was missed.
        seen, reported (S, K): who is seen in each step, and who is reported."""
        from tracking.grouping.belief_kernels import keep_missed

        key = pairs.a * pairs.people + pairs.b
        number = np.searchsorted(key, found.a * pairs.people + found.b)
        cut, before = np.searchsorted(found.step, first + np.arange(len(seen) + 1)), self.gone.copy()
        out = np.empty((len(key) + len(number), 2), np.int64)
        rest = first, cut, number, pairs.a, pairs.b, seen, reported, memory
        count = keep_missed(*rest, self.gone, out)
        if count > len(out):
            out, self.gone = np.empty((count, 2), np.int64), before
            keep_missed(*rest, self.gone, out)
        step, pair = out[:count].T
        # the pair's latest row before each step, in these steps or before them
        order = np.lexsort((found.step, number))
        keys = number[order] * (len(seen) + 1) + found.step[order] - first
        at = np.searchsorted(keys, pair * (len(seen) + 1) + step - first) - 1
        own = (at >= 0) & (np.append(number[order], -1)[at] == pair)
        row = np.append(order, 0)[np.where(own, at, -1)]
        log_odds, noise = self.log_odds[pair], self.noise[pair]
        log_odds[own], noise[own] = found.log_odds[row[own]], found.noise[row[own]]
        self.log_odds[number], self.noise[number] = found.log_odds, found.noise
        return PairBeliefs(step, pairs.a[pair], pairs.b[pair], log_odds, noise, np.ones(count, bool))


_NO_STEPS = (
    StepRows(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 2)), np.zeros(0)),
    Motion(np.zeros((0, 2)), np.zeros((0, len(TIMES), 2)), np.zeros((0, 2)), np.zeros((0, 3))),
)


def _nothing() -> PairBeliefs:
    nobody = np.zeros(0, np.int64)
    return PairBeliefs(nobody, nobody, nobody, np.zeros((0, 2)), np.zeros(0), np.zeros(0, bool))


def _joined(parts: Sequence[PairBeliefs]) -> PairBeliefs:
    return PairBeliefs(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(PairBeliefs)))


def beliefs_of_tracks(
    frame: Ints, column: Ints, pos: Array, length: int, fps: float, belief: Belief, measured: Bools | None = None
) -> PairBeliefs:
    """Returns the beliefs of all pairs of people of a sequence of `length` frames, with rows as of `BeliefHistory.add`.
    measured: its `seen`; None: all are measured."""
    history = BeliefHistory(fps, belief)
    history.take_people(np.full(int(column.max(initial=-1)) + 1, -1))
    seen = np.ones(len(frame), bool) if measured is None else measured
    return history.add(frame, column, pos, seen, length).pairs


@dataclass(frozen=True, slots=True, eq=False)
class PairProbabilities:
    """Rows of pairs, sorted by frame, then ids: frame (R,) from 1; a, b (R,): ids, a < b; probability (R,), 0 to 1."""

    frame: Ints
    a: Ints
    b: Ints
    probability: Array


def pair_probabilities(table: TracksTable, fps: float, belief: Belief) -> PairProbabilities:
    """Returns the probability that two people belong together now, for all pairs less than 4 m apart in each frame.

    A pair's probability is computed once per step of at most 0.4 s and repeated in the frames of that step in which
    both are reported. While one of the two is predicted only, it stays as it was. table: of people at the places from
    which groups are derived (`people_in_metres`).
    """
    found = beliefs_of_tracks(table.frame, table.column, table.pos, table.length, fps, belief, table.seen)
    size = frames_per_step(fps)
    known = found.step * size
    row, frame = runs(known, np.minimum(known + size, table.length))
    a, b, present = found.a[row], found.b[row], table.frame * len(table.ids) + table.column
    both = np.isin(frame * len(table.ids) + a, present) & np.isin(frame * len(table.ids) + b, present)
    row, frame, a, b = row[both], frame[both], a[both], b[both]
    order = np.lexsort((b, a, frame))
    probability = 1 / (1 + np.exp(-found.log_odds[row, 0]))
    return PairProbabilities(frame[order] + 1, table.ids[a[order]], table.ids[b[order]], probability[order])
