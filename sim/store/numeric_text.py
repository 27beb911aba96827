"""Strict reading of text files with rows of numbers into an array (N rows, C columns).

A file with a wrong row raises InputError, which names the first wrong line.
"""

from __future__ import annotations

import io
import re
from collections.abc import Collection, Container, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import COORDINATE, DETECTIONS, FRAMES, TEXT_BYTES, XML_BYTES
from scenarios.reading import read_regular
from sim.types import Array, Bools, Ints

NAME_THEM = "name the columns in the first line, as frame,id,x,y or frame,id,left,top,width,height"

LARGEST = 2**52  # whole numbers pass through float64
CORRECT = "remove or correct it"
OFFSET = "subtract one position near the people from all, if these are geographic, as UTM; else check the columns"


@dataclass(frozen=True)
class NumericTable:
    """The N rows of a numeric text file with C columns."""

    file: Path  # its path, for errors
    values: Array  # (N, C) the numbers, float64
    line: Ints  # (N,) line number of each row in the file, from 1
    layout: str = ""  # what the columns must be, for the remedy of errors that most rows have
    unit: str = "line"  # what a row is in the file, for errors
    classes: tuple[str, ...] = ()  # words that the numbers from 0 in the column of classes stand for; (): none
    names: tuple[tuple[int, str], ...] = ()  # number and word of ids that the file has in words; (): none

    def keep(self, rows: Bools | Ints) -> NumericTable:
        """Returns the table with only these rows: a mask, or indices in order."""
        return replace(self, values=self.values[rows], line=self.line[rows])

    def reject(self, wrong: Bools | np.bool_, expected: str, remedy: str, most: str | None = None) -> None:
        """Raises InputError about the first row where `wrong` (N,) is True. most: the remedy if most rows are wrong."""
        if np.any(wrong):
            k, count, total = int(np.argmax(wrong)), int(np.sum(wrong)), len(self.values)
            got = ",".join(f"{v:g}" for v in self.values[k])
            # If most rows are wrong, the columns are, and not these lines.
            if total > 1 and 2 * count > total:
                got += f" (like {count} of {total} {self.unit}s)"
                remedy = most or f"check the columns, which are {self.layout or 'the same in each line'}"
            place = f"{self.unit} {self.line[k]}"
            raise InputError(file=self.file, place=place, got=got, expected=expected, remedy=remedy)

    def integers(self, column: int, name: str, most: str | None = None) -> Ints:
        """Returns column `column` (from 0) as integers (N,); InputError for others. name, most: for the message."""
        v = self.values[:, column]
        wrong = (v != np.round(v)) | (np.abs(v) > LARGEST)
        self.reject(wrong, f"a whole number within {LARGEST} as {name}", f"correct the {name}", most)
        return v.astype(np.int64)

    def require_bounds(self, frame: Ints, length: int | None = None) -> None:
        """Raises InputError if a frame is not in 1 to `length`, has over 5,000 rows, or a number is too large.

        frame (N,): of each row. length: None: any number of frames up to 1,000,000.
        """
        span, remedy, most = f"frames from 1 to {length or FRAMES}", "correct the frame", None
        if length is not None:
            remedy = "correct the frame, or seqLength"
            count = "number its frames 1, 2, 3, …, as those of the recording are read, also if it has 0, 10, 20, …"
            most = f"check that this text belongs to this recording, and its seqLength, or {count}"
            self.reject((frame == 0) & (frame.max(initial=0) >= length), span, count)
        self.reject(frame == 0, span, "add 1 to all frames, if the file counts them from 0")
        times = frame.max(initial=0) > FRAMES
        remedy = "correct the frame, or name the column t in the first line, if it has times" if times else remedy
        self.reject((frame < 1) | (frame > (length or FRAMES)), span, remedy, remedy if times else most)
        # Memory in proportion to the highest frame: frames are checked before.
        crowded = np.bincount(frame, minlength=1)[frame] > DETECTIONS
        self.reject(crowded, f"at most {DETECTIONS} {self.unit}s of one frame", "check that this is the right file")
        far = ~(np.abs(self.values[:, 2:]) <= COORDINATE).all(axis=1)  # also nan
        self.reject(far, f"numbers within {COORDINATE:g}", CORRECT, OFFSET)


def read_text(path: Path, limit: int = TEXT_BYTES) -> str:
    """Returns the text of the UTF-8 file `path`, without byte order mark; all line ends become line feeds."""
    try:
        text = read_regular(path, limit).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place, remedy = f"byte {error.start}", "save it as UTF-8, or check the path"
        raise InputError(file=path, place=place, got="no UTF-8 text", expected="a text file", remedy=remedy) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


@dataclass(frozen=True)
class TextRows:
    """The rows of a text: its lines that are neither blank nor comments. Commas, semicolons or blanks part cells."""

    file: Path
    text: tuple[str, ...]  # of each row
    line: Ints  # (N,) line number of each row, from 1

    @property
    def separator(self) -> str | None:
        """The separator of cells: a semicolon, else a comma, if the first row has one, else None: blanks."""
        return _separator(self.text[0]) if self.text else None

    def cells(self) -> Iterator[list[str]]:
        """Yields the cells of each row as a list of texts."""
        separator = self.separator
        return (line.split(separator) for line in self.text)

    def words(self, column: int, first: int = 0) -> list[str]:
        """Returns the cells of column number `column` in the rows from `first` on, both from 0; quotes are removed."""
        return [row[column].strip().strip('"') for row in self._below(first).cells() if len(row) > column]

    def _below(self, first: int) -> TextRows:
        return TextRows(self.file, self.text[first:], self.line[first:])

    def numbers(
        self, columns: Collection[int], *, first: int = 0, layout: str = "", use: list[int] | None = None
    ) -> NumericTable:
        """Returns the numbers of the rows from `first` on.

        columns: how many columns are allowed. use: indices (from 0) of the columns to read; the others need not hold
        numbers; None: all. layout: words for the columns, for messages. Raises InputError for the first wrong row.
        """
        rows = self._below(first)
        if not rows.text:
            return NumericTable(self.file, np.zeros((0, max(columns))), rows.line, layout)
        width = len(next(rows.cells()))
        if width not in columns:
            use = None  # the columns are others than those named: an error below
        fits = columns if use is not None else (width,)
        try:
            text = io.StringIO("\n".join(rows.text))
            values = np.loadtxt(text, delimiter=rows.separator, comments=None, ndmin=2, dtype=np.float64, usecols=use)
            if use is not None and not {len(cells) for cells in rows.cells()} <= {*columns}:
                raise ValueError("lines of different lengths")
        except ValueError:
            raise rows._first_bad(fits, use, layout) from None
        table = NumericTable(self.file, values, rows.line, layout)
        if width not in columns:
            remedy = layout and f"the columns are {layout}"
            table.reject(np.ones(len(values), bool), f"{', '.join(map(str, columns))} columns", remedy, remedy)
        table.reject(~np.isfinite(values).all(axis=1), "finite numbers", CORRECT)
        return table

    def _first_bad(self, fits: Container[int], use: list[int] | None, layout: str) -> InputError:
        width = len(next(self.cells()))
        for number, line, cells in zip(self.line, self.text, self.cells(), strict=True):
            read = use if use is not None and len(cells) in fits else range(len(cells))
            bad = [k for k in read if not is_number_text(cells[k])]
            if bad or len(cells) not in fits:
                got, expected = f"{len(cells)} columns", f"{width} columns, as in the first line"
                if bad:
                    got, expected = repr(cells[bad[0]].strip()), f"a number as cell {bad[0] + 1}"
                parts = line.split(";" if ";" in line else None)  # whatever the separator was taken to be
                comma = bad and any("," in part and is_number_text(part.replace(",", ".")) for part in parts)
                remedy = "write decimals with a point" if comma else CORRECT
                # What is wrong from the first row on is another column, and not a cell.
                if layout and bad and not comma and number == self.line[0]:
                    remedy += f"; the columns are {layout}"
                return InputError(file=self.file, place=f"line {number}", got=got, expected=expected, remedy=remedy)
        return InputError(file=self.file, got="unreadable numbers", expected="rows of numbers", remedy="check the file")


def read_rows(path: Path, heading: bool = False) -> TextRows:
    """Returns the rows of the text file `path`. heading: as of `rows_among`."""
    return rows_among(path, read_text(path).splitlines(), heading)


def rows_among(path: Path, lines: list[str], heading: bool = False) -> TextRows:
    """Returns the rows among the first lines of the text file `path`, without comments: lines that begin with #.

    heading: True keeps, without its #, the last comment before the first row that may name the columns: it has as many
    cells as that row, none of which is a number.
    """
    numbered = [(k, line) for k, line in enumerate(lines, 1) if line.strip()]
    found = [(k, line) for k, line in numbered if line[:1] != "#"]
    if heading and found:
        above = [(k, line.lstrip("# ")) for k, line in numbered[: numbered.index(found[0])]]
        found = [each for each in above if _may_name(each[1], found[0][1])][-1:] + found
    return TextRows(path, tuple(line for _, line in found), np.array([k for k, _ in found], np.int64))


def _may_name(heading: str, row: str) -> bool:
    names, cells = (line.split(_separator(line)) for line in (heading, row))
    return len(names) == len(cells) and not any(map(is_number_text, names))


def _separator(line: str) -> str | None:
    return next((mark for mark in ";," if mark in line), None)


def is_number_text(cell: str) -> bool:
    """Returns True if `read_number` accepts the text."""
    try:
        read_number(cell)
    except ValueError:
        return False
    return True


def read_number(text: str) -> float:
    """Returns the number that a text states; unlike float() it refuses underscores and non-ASCII (ValueError)."""
    if "_" in text or not text.strip().isascii():
        raise ValueError(f"{text!r} is no number")
    return float(text)


def whole_or_number(text: str) -> int | float | str:
    """Returns an int for a whole number of up to 18 digits, a float for another number, else the text itself."""
    whole = re.fullmatch("[-+]?[0-9]{1,18}", text.strip())  # more digits may not fit into 64 bits
    return int(text) if whole else read_number(text) if is_number_text(text) else text


def number_or_nan(text: str | None) -> float:
    """Returns the number that a text states; nan for None and for a text that is no number."""
    return read_number(text) if text is not None and is_number_text(text) else float("nan")


def bounded_number(path: Path, place: str, text: str | None, low: float, high: float, whole: bool = False) -> float:
    """Returns the number that a text states; InputError unless from `low` to `high` and, if `whole`, a whole number."""
    value = number_or_nan(text)
    got = "nothing" if text is None else repr(text)
    expected = f"a {'whole ' if whole else ''}number from {low:.12g} to {high:.12g}"
    reject(not low <= value <= high or (whole and value % 1), path, got, expected, "correct it", place)
    return value


def person_ids(path: Path, place: str, text: str) -> set[int]:
    """Returns the ids, whole numbers from 0, that a text lists with blanks or commas between; else InputError."""
    values = [number_or_nan(word) for word in text.replace(",", " ").split()]
    if not all(0 <= v <= LARGEST and v == round(v) for v in values):
        expected = "ids of people, whole numbers from 0 on"
        raise InputError(file=path, place=place, got=text.strip(), expected=expected, remedy="correct the list")
    return {int(v) for v in values}


def xml_root(path: Path, expected: str, remedy: str) -> ElementTree.Element:
    """Returns the root of an XML file; raises InputError for broken XML. expected, remedy: for the message."""
    try:
        return ElementTree.fromstring(read_regular(path, XML_BYTES))
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # the last two: an encoding that Python lacks
        place = f"line {error.position[0]}" if isinstance(error, ElementTree.ParseError) else "line 1"
        got = f"broken XML ({error})"
        raise InputError(file=path, place=place, got=got, expected=expected, remedy=remedy) from None
