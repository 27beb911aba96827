"""Cells of named columns that need more than a number: times in any unit or as ISO 8601, and ids in words.

A unit of times that the column's name does not state follows from their usual step: 0.1 to 300 times per second.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from scenarios.errors import InputError, reject
from sim.store.numeric_text import CORRECT, LARGEST, NumericTable, is_number_text, read_number
from sim.types import Array
from tracking.recordings.options import RATES

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # s
UNITS = "s, ms, us or ns"
NOTHING = ("", "none", "null", "nan", "na", "n/a", "<na>")  # cells of no value, in lower case
SHOWN = 8  # most ids or values that a message lists


def usual_step(times: Array, id: Array) -> float:
    """Returns the step at which times (N,) of one id (N,) follow each other where none is missing; 0: unknown."""
    id, times = np.unique(np.column_stack([id, times]), axis=0).T
    step = np.diff(times)[np.diff(id) == 0]
    return float(step[step < 1.5 * np.median(step)].mean()) if len(step) else 0.0


def in_seconds(file: Path, name: str, times: Array, id: Array) -> Array:
    """Returns times (N,) of rows with ids (N,) in s: by the unit that ends the column's name, else by the usual step.

    Warns of a unit that the step tells. Raises InputError if it tells none, or two.
    """
    stated = name.rpartition("_")[2]
    if stated in TIME_UNITS and stated != name:
        return times * TIME_UNITS[stated]
    step = usual_step(times, id)
    if not step:
        return times
    fit = [unit for unit, s in TIME_UNITS.items() if RATES[0] <= 1 / (step * s) <= RATES[1]]
    got = f"times in steps of {step:.6g}, {' or '.join(fit) or 'in no unit'}"
    names = ", ".join(f"{name.removeprefix('timestep_')}_{unit}" for unit in TIME_UNITS)
    remedy = f"name the column by its unit, {names}; or number frames 1, 2, 3, … in a column frame"
    reject(len(fit) != 1, file, got, "{:g} to {:g} times per second".format(*RATES), remedy, f"column {name}")
    if fit != ["s"]:
        words = f"times in steps of {step:.6g} are taken as {fit[0]}"
        warnings.warn(f"{file}: column {name}: {words} (the name {name}_{fit[0]} says so)", stacklevel=5)
    return times * TIME_UNITS[fit[0]]


def instants(rows: NumericTable, cells: Sequence[str]) -> Array:
    """Returns the seconds (N,) of cells that are numbers, or dates with times as in ISO 8601; without zone: UTC."""
    return np.array([_instant(rows, k, cell) for k, cell in enumerate(cells)])


def _instant(rows: NumericTable, k: int, cell: str) -> float:
    try:
        if is_number_text(cell):
            return read_number(cell)
        found = datetime.fromisoformat(cell)
    except ValueError:
        place, expected = f"line {rows.line[k]}", "a number, or a time as 2024-05-01T12:00:00.5+02:00"
        raise InputError(file=rows.file, place=place, got=repr(cell), expected=expected, remedy=CORRECT) from None
    return (found if found.tzinfo else found.replace(tzinfo=UTC)).timestamp()


def numbered(rows: NumericTable, cells: Sequence[str], what: str) -> tuple[Array, tuple[tuple[int, str], ...]]:
    """Returns ids or groups (N,) in place of words, and the number and word of each; warns of it.

    ped7 is 7 if each word ends in a number of its own; else words are numbered 1, 2, 3, … as they first appear. -1
    stays so. Raises InputError for one of NOTHING. what: "id" or "group".
    """
    none = [k for k, cell in enumerate(cells) if cell.lower() in NOTHING]
    if none:
        place, expected = f"line {rows.line[none[0]]}", f"one {what} in each line, or -1 for none"
        raise InputError(file=rows.file, place=place, got=f"no {what}", expected=expected, remedy="add it")
    words = [word for word in dict.fromkeys(cells) if word != "-1"]
    ends = [int(end[0]) if (end := re.search("[0-9]{1,15}$", word)) else LARGEST for word in words]
    own = len(set(ends)) == len(ends) and max(ends) < LARGEST
    number = dict(zip(words, ends if own else range(1, len(words) + 1), strict=True))
    shown = ", ".join(f"{word} as {id}" for word, id in list(number.items())[:SHOWN]) + ", …" * (len(words) > SHOWN)
    warnings.warn(f"{rows.file}: {what}s in words are numbered: {shown}", stacklevel=5)
    names = tuple((id, word) for word, id in number.items())
    return np.array([number.get(cell, -1) for cell in cells], np.float64), names
