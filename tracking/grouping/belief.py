"""The belief that two people belong together: of each pair and step its log-odds, from fitted tables of evidence.

The belief of a row (`pair_evidence`) is a sum of tables, read off by linear interpolation, between values of a quantity
and between levels of noise: the same chord tells less where positions err more. `flockscope fit grouping` fits the
tables to simulated scenes and writes them as a text file; belief.toml beside this module is the default.

From one evidence two decisions, each with a column of log-odds in every table. Who is together *now* follows from the
probability and `threshold`, by the loss of pairwise F1. *Events* follow from groups that change late (`stay`, `come`),
as a false event costs more than a late one; their log-odds are fitted to scenes in which people meet and part.

`pair_beliefs` gives the log-odds, `pair_probabilities` the probability of each pair of tracked people in each frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import is_number
from scenarios.loading.toml_files import parse, toml_value
from sim.types import Array, Ints
from tracking.grouping.pair_evidence import NAMES

FROZEN = Path(__file__).with_name("belief.toml")  # The default belief.
KIND = "belief"
UNSEEN = -4.0  # Belief about two people who are too far apart for a row: log-odds.
DECISIONS = NOW, EVENTS = ("now", "events")  # Columns of a table.
NUMBERS = ("share", "hold", "join", "stay", "come", "nearest", "memory")  # Numbers of `Belief` in its file.
SHARES = {"share": (0.001, 0.999), **dict.fromkeys(("threshold", "hold", "join", "nearest"), (0.0, 1.0))}  # Bounds.


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Evidence from one quantity, in log-odds: piecewise linear, constant beyond the ends, 0 where it is unknown."""

    name: str  # one of `NAMES`
    at: Array  # (K,): ascending values of the quantity
    log_odds: Array  # (2, L, K): for `DECISIONS`, by levels of noise, at these values


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """A fitted belief: its tables, and how beliefs of pairs become groups."""

    tables: tuple[Table, ...]
    noise: Array  # (L,): ascending levels of noise, m, the standard deviation of a person's position
    bias: Array  # (2, L): log-odds added to the tables, for `DECISIONS`, by levels of noise
    threshold: Array  # (L,): probability above which two people are together now, by levels of noise
    share: float = 0.1  # of mates among the pairs of the fit, where none is known (`mate_share`)
    # hold, join: probability added for pairs that were in one group a step before, and taken from all others: the
    # greater they are, the longer the groups of now last; stay, come: the same in log-odds, for the groups of events
    hold: float = 0.3
    join: float = 0.1
    stay: float = 7.0
    come: float = 1.2
    nearest: float = 0.4  # share of the nearest pairs, not all, in what two groups are worth together
    memory: float = 1.0  # (s): a missed member stays so long in the group

    @property
    def neutral(self) -> float:
        """Log-odds that change nothing: in the middle between linking two people and separating them."""
        return (self.come - self.stay) / 2

    def as_dict(self) -> dict[str, object]:
        """Returns the entries of run.json about the belief: kind, its numbers, and a hash of `toml_text`."""
        text, numbers = self.toml_text().encode(), {name: getattr(self, name) for name in NUMBERS}
        return {"grouping": KIND, "threshold": self.threshold.tolist(), **numbers, "hash": sha256(text).hexdigest()}

    @classmethod
    def from_toml(cls, path: str | Path) -> Belief:
        """Returns the belief in a file that `toml_text` wrote. Raises InputError for another file or wrong values."""
        content = parse(Path(path))
        rows, keys = content.pop("table", None), {"noise", "bias", "threshold", *NUMBERS}
        if content.pop("grouping", None) != KIND or not isinstance(rows, list) or not rows:
            _refuse(path, "grouping", "another file", f'grouping = "{KIND}" and at least one [[table]]')
        if content.keys() != keys:
            _refuse(path, min(content.keys() - keys, default="its keys"), sorted(content), ", ".join(sorted(keys)))
        noise = _ascending(path, "noise", content.pop("noise"), low=0.0)
        bias = _matrix(path, "bias", content.pop("bias"), (len(DECISIONS), len(noise)))
        threshold = _numbers(path, "threshold", content.pop("threshold"), len(noise), *SHARES["threshold"])
        numbers = {
            name: float(_numbers(path, name, [value], 1, *SHARES.get(name, (0.0, math.inf)))[0])
            for name, value in content.items()
        }
        tables = tuple(_table(path, f"table {k}", row, len(noise)) for k, row in enumerate(rows, 1))
        return cls(tables, noise, bias, threshold, **numbers)

    def toml_text(self, comment: str = "") -> str:
        """Returns the belief as the text of a TOML file. comment: lines of text to begin it with, without "#"."""
        lines = [*(f"# {line}" for line in comment.splitlines()), f'grouping = "{KIND}"']
        arrays = ("noise", "bias", "threshold")
        lines += [f"{name} = {toml_value(np.round(getattr(self, name), 3).tolist())}" for name in arrays]
        lines += [f"{name} = {toml_value(round(float(getattr(self, name)), 4))}" for name in NUMBERS]
        for table in self.tables:
            lines += ["", "[[table]]", f"name = {toml_value(table.name)}"]
            rows = {"at": table.at, **dict(zip(DECISIONS, table.log_odds, strict=True))}
            lines += [f"{key} = {toml_value(np.round(values, 3).tolist())}" for key, values in rows.items()]
        return "\n".join([*lines, ""])

    def log_odds(self, values: Array, noise: Array) -> Array:
        """Returns log-odds (R, 2), columns as `DECISIONS`, of R rows of quantities (R, len(NAMES)), nan if unknown, and
        of the noise of positions (R,), m."""
        from tracking.grouping.belief_kernels import table_sums

        return table_sums(values, noise, self.noise, self.bias, *_joined(self))

    def together(self, log_odds: Array, noise: Array) -> Array:
        """Returns by how much the probability of log-odds (R,) of now exceeds the threshold at noise (R,), m."""
        return np.asarray(1 / (1 + np.exp(-log_odds)) - np.interp(noise, self.noise, self.threshold))


@lru_cache(maxsize=8)
def _joined(belief: Belief) -> tuple[Ints, Ints, Array, Array]:
    """Returns all tables as one: column of each among `NAMES`, where its knots begin and end, knots, and log-odds."""
    column = np.array([NAMES.index(table.name) for table in belief.tables])
    cut = np.cumsum([0, *(len(table.at) for table in belief.tables)])
    at = np.concatenate([table.at for table in belief.tables])
    return column, cut, at, np.concatenate([table.log_odds for table in belief.tables], axis=2)


@cache
def default_belief() -> Belief:
    """Returns the belief of belief.toml, which is fitted to simulated scenes."""
    return Belief.from_toml(FROZEN)


def _table(path: str | Path, place: str, row: Any, levels: int) -> Table:
    keys = ("name", "at", *DECISIONS)
    if not isinstance(row, dict) or set(row) != set(keys):
        _refuse(path, place, row, ", ".join(keys))
    if row["name"] not in NAMES:
        _refuse(path, f"{place}: name", row["name"], "one of " + "; ".join(NAMES))
    at = _ascending(path, f"{place}: at", row["at"])
    heights = [_matrix(path, f"{place}: {key}", row[key], (levels, len(at))) for key in DECISIONS]
    return Table(row["name"], at, np.array(heights))


def _ascending(path: str | Path, place: str, values: Any, low: float = -math.inf) -> Array:
    found = _numbers(path, place, values, len(values) if isinstance(values, list) else 1, low)
    if len(found) < 2 or (np.diff(found) <= 0).any():
        _refuse(path, place, values, "two ascending numbers or more")
    return found


def _matrix(path: str | Path, place: str, rows: Any, shape: tuple[int, int]) -> Array:
    if not isinstance(rows, list) or len(rows) != shape[0]:
        _refuse(path, place, rows, f"{shape[0]} rows of {shape[1]} numbers")
    return np.array([_numbers(path, place, row, shape[1]) for row in rows])


def _numbers(
    path: str | Path, place: str, values: Any, count: int, low: float = -math.inf, high: float = math.inf
) -> Array:
    if not isinstance(values, list) or len(values) != count or not all(is_number(v, low, high) for v in values):
        above = f" of {low:g} or above" if math.isfinite(low) else ""
        bounds = f" from {low:g} to {high:g}" if math.isfinite(high) else above
        _refuse(path, place, values, f"numbers ({count}){bounds}")
    return np.array(values, float)


def _refuse(path: str | Path, place: str, got: object, expected: str) -> None:
    remedy = "write the file with: flockscope fit grouping"
    raise InputError(file=path, place=place, got=repr(got), expected=expected, remedy=remedy)
