"""The belief that two people belong together: log-odds of each pair over time, from fitted tables of evidence.

The evidence of a row (`pair_evidence`) is a sum of tables, read off by linear interpolation: one value for people who
walk, one for people who stand, mixed by the pair's speed over 2 s. The belief follows the evidence with a delay, longer
for people who stand: L(t) = e L(t - dt) + (1 - e) evidence(t), e = exp(-dt / time). `flockscope fit grouping` fits the
tables to simulated scenes and writes them as a text file; belief.toml beside this module is the default.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import is_number
from scenarios.loading.toml_files import parse, toml_value
from sim.types import Array, Ints
from tracking.grouping.pair_evidence import NAMES, PairRows, evidence, frames_per_step, step_positions

FROZEN = Path(__file__).with_name("belief.toml")
"""The default belief."""
KIND = "belief"
STANDS, WALKS = 0.2, 0.6
"""m/s: a pair counts as standing below the first, as walking above the second, in between in proportion."""
SPEED = NAMES.index("speed, 2 s")
NUMBERS = ("bias", "walking_time", "standing_time", "join", "part", "unseen", "patience", "memory", "arrival")
"""Numbers of `Belief` in its file."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Evidence from one quantity, in log-odds: piecewise linear, constant beyond the ends, 0 where it is unknown.

    name: one of `NAMES`. at (K,): ascending values of the quantity. walking, standing (K,): log-odds at these values,
    for people who walk and who stand.
    """

    name: str
    at: Array
    walking: Array
    standing: Array

    def evidence(self, value: Array, standing: Array) -> Array:
        """Returns the log-odds (R,) of values (R,), nan for unknown; standing (R,): how far the pair stands, 0 to 1."""
        found, some = np.interp(value, self.at, self.walking), standing > 0
        found[some] += standing[some] * (np.interp(value[some], self.at, self.standing) - found[some])
        return np.asarray(np.where(np.isnan(value), 0.0, found))


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """A fitted belief: its tables, and how beliefs of pairs become groups.

    bias: log-odds added to the tables. walking_time, standing_time: s with which the belief follows the evidence.
    join, part: times per second that strangers become mates, and mates strangers; the decision who is in one group
    assumes them, and needs the longer to change the smaller they are. unseen: log-odds of two members of a group
    without a row. patience (s): a link breaks after the two have been in different groups for so long. memory (s): a
    missed member stays so long in the group. arrival (s): a link that began so soon after a track's first frame is no
    merge.
    """

    tables: tuple[Table, ...]
    bias: float
    walking_time: float
    standing_time: float
    join: float = 0.01
    part: float = 0.05
    unseen: float = -4.0
    patience: float = 2.0
    memory: float = 1.0
    arrival: float = 1.0

    @property
    def smooth(self) -> float:
        """Time over which velocities of tracks are replaced by chords, s: 0, as the belief uses positions only."""
        return 0.0

    def as_dict(self) -> dict[str, object]:
        """Returns what run.json tells of the belief: its numbers, and a hash of its file's text."""
        text = self.toml_text().encode()
        return {"grouping": KIND, **{name: getattr(self, name) for name in NUMBERS}, "hash": sha256(text).hexdigest()}

    @classmethod
    def from_toml(cls, path: str | Path) -> Belief:
        """Returns the belief of a file that `toml_text` wrote. Raises InputError if it is none or values are wrong."""
        content = parse(Path(path))
        kind, rows = content.pop("grouping", None), content.pop("table", None)
        if kind != KIND or not isinstance(rows, list) or not rows:
            _refuse(path, "grouping", kind, f'grouping = "{KIND}" and at least one [[table]]')
        if unknown := sorted(content.keys() - set(NUMBERS)):
            _refuse(path, unknown[0], "an unknown key", "one of " + ", ".join(NUMBERS))
        for name in NUMBERS:
            low = -math.inf if name in ("bias", "unseen") else 0.0
            if not is_number(content.get(name), low, math.inf):
                _refuse(path, name, content.get(name, "nothing"), "a number" + (" of 0 or above" if low == 0 else ""))
        return cls(tuple(_table(path, k, row) for k, row in enumerate(rows, 1)), **content)

    def toml_text(self, comment: str = "") -> str:
        """Returns the file's text. comment: lines at its beginning."""
        lines = [*(f"# {line}" for line in comment.splitlines()), f'grouping = "{KIND}"']
        lines += [f"{name} = {toml_value(round(float(getattr(self, name)), 4))}" for name in NUMBERS]
        for table in self.tables:
            columns = {key: np.round(getattr(table, key), 4).tolist() for key in ("at", "walking", "standing")}
            lines += ["", "[[table]]", f"name = {toml_value(table.name)}"]
            lines += [f"{key} = {toml_value(values)}" for key, values in columns.items()]
        return "\n".join([*lines, ""])

    def evidence(self, values: Array) -> Array:
        """Returns the log-odds (R,) of rows of quantities (R, len(NAMES)) alone, without the past beliefs."""
        standing = stands(values)
        found = (t.evidence(values[:, NAMES.index(t.name)], standing) for t in self.tables)
        return np.asarray(sum(found, np.full(len(values), self.bias)))

    def times(self, values: Array) -> Array:
        """Returns the times (R,), s, with which the beliefs of rows (R, len(NAMES)) follow the evidence."""
        standing = stands(values)
        return np.asarray(self.walking_time ** (1 - standing) * self.standing_time**standing)


def stands(values: Array) -> Array:
    """Returns how far each pair stands, (R,), from 0 to 1; 0 where the speed is unknown. values (R, len(NAMES))."""
    speed = values[:, SPEED]
    return np.where(np.isnan(speed), 0.0, np.clip((WALKS - speed) / (WALKS - STANDS), 0.0, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class PairBeliefs:
    """Log-odds that two people belong together, one row per pair and step in which both were seen within 4 m.

    step (R,): from 0, ascending; a, b (R,): columns, a < b; log_odds (R,). distance (m), differ (m/s) (R,): distance,
    and difference of velocities.
    """

    step: Ints
    a: Ints
    b: Ints
    log_odds: Array
    decision: Array
    distance: Array
    differ: Array


def pair_beliefs(pos: Array, seconds: float, belief: Belief) -> PairBeliefs:
    """Returns the beliefs of all pairs of people who come within 4 m of each other. Nothing looks ahead.

    pos (S, P, 2): m by step and person (`step_positions`), nan where not seen. seconds: length of a step, s.
    """
    memory = PairMemory(belief, seconds)
    parts = []
    for rows in evidence(pos, seconds):
        near = (rows.values[:, NAMES.index(name)] for name in ("distance", "velocity difference"))
        parts.append((rows.step, rows.a, rows.b, *memory.follow(rows), *near))
    if not parts:
        nobody, none = np.zeros(0, np.int64), np.zeros(0)
        return PairBeliefs(nobody, nobody, nobody, none, none, none, none)
    return PairBeliefs(*(np.concatenate(column) for column in zip(*parts, strict=True)))


class PairMemory:
    """The beliefs of pairs while time goes on.

    State, by pair (K,): last, the step of the pair's last row; log_odds, the belief after it; decision, the log-odds of
    the Markov relation. K grows with the pairs.
    """

    def __init__(self, belief: Belief, seconds: float) -> None:
        """seconds: length of a step, s."""
        self.belief, self.seconds = belief, seconds
        self.last, self.log_odds, self.decision = np.zeros(0, np.int64), np.zeros(0), np.zeros(0)

    def follow(self, rows: PairRows) -> tuple[Array, Array]:
        """Takes the next rows, in order, and returns the belief and the decision after each, (R,), (R,)."""
        self._grow(int(rows.pair.max(initial=-1)) + 1)
        target, time = self.belief.evidence(rows.values), self.belief.times(rows.values)
        out = np.empty((2, len(target)))
        for r in np.split(np.arange(len(target)), np.flatnonzero(np.diff(rows.step)) + 1):
            k, now = rows.pair[r], target[r]
            new = np.isnan(self.log_odds[k])
            late = np.asarray((rows.step[r] - self.last[k]) * self.seconds, float)
            stay = np.exp(-late / time[r])
            log_odds = now + stay * (np.where(new, now, self.log_odds[k]) - now)
            decision = changed(self.decision[k], self.belief.join, self.belief.part, late) + self.seconds * log_odds
            decision = np.where(new, log_odds, decision)
            out[:, r] = log_odds, decision
            self.last[k], self.log_odds[k], self.decision[k] = rows.step[r], log_odds, decision
        return out[0], out[1]

    def _grow(self, pairs: int) -> None:
        more = max(pairs - len(self.last), 0)
        self.last = np.append(self.last, np.zeros(more, np.int64))
        self.log_odds, self.decision = (np.append(x, np.full(more, np.nan)) for x in (self.log_odds, self.decision))


def changed(log_odds: Array, join: float, part: float, seconds: Array) -> Array:
    """Returns the log-odds (R,) of a relation after `seconds` (R,) without evidence.

    log_odds (R,): before. Strangers join `join` times, mates part `part` times per second.
    """
    usual = join / (join + part)
    odds = np.exp(-np.abs(log_odds))
    share = np.where(log_odds > 0, 1.0, odds) / (1 + odds)
    share = usual + (share - usual) * np.exp(-(join + part) * seconds)
    return np.asarray(np.log(share / (1 - share)))


def beliefs_of_tracks(frame: Ints, column: Ints, pos: Array, length: int, fps: float, belief: Belief) -> PairBeliefs:
    """Returns the beliefs of all pairs of people of a sequence of `length` frames.

    A row is one person in one frame: frame (R,) from 0; column (R,): number of the person, from 0; pos (R, 2): x, y in
    m. fps: frames per second. Step s of the result is known in frame (s + 1) `frames_per_step(fps)` - 1.
    """
    size = frames_per_step(fps)
    places = step_positions(frame, column, pos, length, int(column.max(initial=-1)) + 1, fps)
    return pair_beliefs(places, size / fps, belief)


@cache
def default_belief() -> Belief:
    """Returns the belief of belief.toml, which is fitted to simulated scenes."""
    return Belief.from_toml(FROZEN)


def _table(path: str | Path, number: int, row: Any) -> Table:
    """Returns a table of a file; number: its place among the tables, from 1. Raises InputError if it is wrong."""
    place = f"table {number}"
    if not isinstance(row, dict) or set(row) != {"name", "at", "walking", "standing"}:
        _refuse(path, place, sorted(row) if isinstance(row, dict) else row, "name, at, walking, standing")
    if row["name"] not in NAMES:
        _refuse(path, f"{place}: name", row["name"], "one of " + "; ".join(NAMES))
    columns = []
    for key in ("at", "walking", "standing"):
        values = row[key]
        if not isinstance(values, list) or not all(is_number(v, -math.inf, math.inf) for v in values):
            _refuse(path, f"{place}: {key}", values, "a list of numbers")
        columns.append(np.array(values, float))
    at, walking, standing = columns
    if len(at) < 2 or not len(at) == len(walking) == len(standing) or (np.diff(at) <= 0).any():
        _refuse(path, f"{place}: at", row["at"], "ascending numbers, two or more, as many as walking and standing")
    return Table(row["name"], at, walking, standing)


def _refuse(path: str | Path, place: str, got: object, expected: str) -> None:
    remedy = "write the file with: flockscope fit grouping"
    raise InputError(file=path, place=place, got=repr(got), expected=expected, remedy=remedy)
