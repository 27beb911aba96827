"""Strict reading of text files with rows of numbers into an array (N rows, C columns).

A file with a wrong row raises InputError, which names the first wrong line.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import DETECTIONS, TEXT_BYTES
from scenarios.regular_file import read_regular
from sim.types import Array, Bools, Ints

NAME_THEM = "name the columns in the first line, as frame,id,x,y or frame,id,left,top,width,height"

WHOLE = re.compile("[-+]?[0-9]{1,18}")


@dataclass(frozen=True)
class NumericTable:
    """The N rows of a numeric text file with C columns.

    file: its path, for errors. values (N, C): the numbers, float64. line (N,): line number of each row in the file,
    from 1. layout: what the columns must be, for the remedy of errors that most rows have.
    """

    file: Path
    values: Array
    line: Ints
    layout: str = ""

    def reject(self, wrong: Bools | np.bool_, expected: str, remedy: str, most: str | None = None) -> None:
        """Raise InputError about the first row where `wrong` is True; do nothing if there is none.

        wrong: flags (N,), one per row; a single True means the first row. expected, remedy: texts of the error: what
        should be there, and what to do. most: the remedy if most rows are wrong, which is no fault of the lines; None:
        to check the columns. The error also names the file, the row's line and its numbers.
        """
        if np.any(wrong):
            k, count, total = int(np.argmax(wrong)), int(np.sum(wrong)), len(self.values)
            got = ",".join(f"{v:g}" for v in self.values[k])
            if total > 1 and 2 * count > total:
                got += f" (like {count} of {total} lines)"
                remedy = most or f"check the columns, which are {self.layout or 'the same in each line'}"
            raise InputError(file=self.file, place=f"line {self.line[k]}", got=got, expected=expected, remedy=remedy)

    def integers(self, column: int, name: str) -> Ints:
        """Return column number `column` (from 0) as integers (N,).

        name: what the column holds, for the error. Raises InputError, with the line, at the first value that is not an
        integer or is beyond ±2**52.
        """
        v = self.values[:, column]
        self.reject((v != np.round(v)) | (np.abs(v) > 2**52), f"a whole number as {name}", f"correct the {name}")
        return v.astype(np.int64)


def read_text(path: Path, limit: int = TEXT_BYTES) -> str:
    """Return the text of the UTF-8 file `path`, without byte order mark; all line ends become line feeds.

    limit: the greatest size in bytes, by default 128 MB. Raises InputError if the file is unreadable, no regular file,
    larger, or not UTF-8.
    """
    try:
        text = read_regular(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            file=path, place=f"byte {error.start}", got="no UTF-8 text", expected="a text file", remedy="check the path"
        ) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def crowded(frame: Ints) -> Bools:
    """Return flags (N,), True for rows of frames that have more than 5000 rows.

    frame (N,): from 0 on. It takes memory in proportion to the highest, so frames must be checked before.
    """
    return np.asarray(np.bincount(frame, minlength=1)[frame] > DETECTIONS)


def whole_number(text: str) -> int:
    """Return the whole number that a cell stands for: ASCII digits, perhaps with a sign and blanks around.

    Raises ValueError for any other text, and for more than 18 digits, which may not fit into 64 bits.
    """
    if not WHOLE.fullmatch(text.strip()):
        raise ValueError(f"{text!r} is no whole number")
    return int(text)


def read_numbers(
    path: Path, columns: tuple[int, int], also: int | None = None, *, header: bool = False, layout: str = ""
) -> NumericTable:
    """Read all non-empty lines of a text file as rows of numbers, separated by commas if the first has one, else by
    blanks.

    columns: (least, greatest) number of columns. also: another number that is allowed; None: none. header: True
    skips the first line. layout: of the table, for errors. A file without lines
    gives a table of shape (0, columns[0]). Comments and headers are not allowed.

    Raises InputError if the file is unreadable or not UTF-8. Raises InputError with the line if a cell is not a finite
    number, the lines differ in their number of columns, or that number is not allowed.
    """
    numbered = [(k, line) for k, line in enumerate(read_text(path).splitlines(), 1) if line.strip()][header:]
    if not numbered:
        return NumericTable(path, np.zeros((0, columns[0])), np.zeros(0, np.int64), layout)
    lines = np.array([k for k, _ in numbered], np.int64)
    separator = "," if "," in numbered[0][1] else None
    try:
        text = io.StringIO("\n".join(line for _, line in numbered))
        values = np.loadtxt(text, delimiter=separator, comments=None, ndmin=2, dtype=np.float64)
    except ValueError:
        raise _first_bad_line(path, numbered, separator) from None
    rows = NumericTable(path, values, lines, layout)
    low, high = columns
    if not low <= values.shape[1] <= high and values.shape[1] != also:
        span = (str(low) if low == high else f"{low} to {high}") + ("" if also is None else f" or {also}")
        remedy = layout and f"the columns are {layout}"
        rows.reject(np.ones(len(lines), bool), f"{span} columns", remedy, remedy)
    rows.reject(~np.isfinite(values).all(axis=1), "finite numbers", "remove or correct the line")
    return rows


def _first_bad_line(path: Path, numbered: list[tuple[int, str]], separator: str | None) -> InputError:
    """Return (not raise) the InputError for the first line that holds a word or has another number of cells than the
    first.

    numbered: (line number from 1, text) of the non-empty lines. separator: "," or None for blanks. Without such a line
    the error is about the whole file.
    """
    width = len(numbered[0][1].split(separator))
    for k, line in numbered:
        cells = line.split(separator)
        bad = next((c for c in cells if not is_number_text(c)), None)
        if bad is not None or len(cells) != width:
            got = repr(bad.strip()) if bad is not None else f"{len(cells)} columns"
            expected = "a number" if bad is not None else f"{width} columns, as in the first line"
            remedy = "remove or correct the line"
            if line.startswith("#"):
                remedy = f"remove the lines that begin with #, and {NAME_THEM}"
            return InputError(file=path, place=f"line {k}", got=got, expected=expected, remedy=remedy)
    return InputError(file=path, got="unreadable numbers", expected="rows of numbers", remedy="check the file")


def is_number_text(cell: str) -> bool:
    """Return True if `read_number` reads the cell."""
    try:
        read_number(cell)
    except ValueError:
        return False
    return True


def read_number(text: str) -> float:
    """Return the number that a text stands for, as numpy reads it: unlike float(), it takes no underscore and ASCII
    digits only. Raises ValueError for any other text.
    """
    if "_" in text or not text.strip().isascii():
        raise ValueError(f"{text!r} is no number")
    return float(text)
