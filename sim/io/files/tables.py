"""The project's Parquet tables and JSON files, to bytes and strictly back.

Each column of a table has a unit, and the table has metadata in its schema. Equal content gives equal bytes. nan is
null in JSON.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from scenarios.limits import JSON_BYTES, is_number
from scenarios.parsing import parse_json
from scenarios.regular_file import require_regular
from sim.types import Array, Ints

FORMAT = 1
KEY = b"flockscope"
REDO = "run the command that made it again"


@dataclass(frozen=True)
class Column:
    """A column of a Parquet table to write.

    name: of the column. values: an array (R,), or R arrays of any lengths for a column of lists. unit: its unit as a
    text, "1" for none. kind: number type of the arrays of a column of lists, by default float64; ignored otherwise.
    """

    name: str
    values: NDArray[Any] | list[NDArray[Any]]
    unit: str = "1"
    kind: type = np.float64


@dataclass(frozen=True)
class StoredTable:
    """A Parquet table of R rows as read from `file`.

    columns: by name an array (R,). For a column of lists it is the pair (all values in one array; array (R,) of the
    index after each list's last value). facts: the metadata that was stored with the table, by name, and "format".
    """

    file: Path
    columns: dict[str, Any]
    facts: dict[str, Any]

    def has(self, name: str) -> bool:
        """Return True if the table has this column."""
        return name in self.columns

    def floats(self, *names: str) -> Array:
        """Return the columns `names` as float64: one as (R,), n > 1 as (R, n).

        Raises InputError if a column is missing or no numbers.
        """
        found = [np.asarray(self._numbers(name, "iufb"), np.float64) for name in names]
        return found[0] if len(found) == 1 else np.stack(found, axis=1)

    def ints(self, name: str) -> Ints:
        """Return column `name` as (R,), int64. Raises InputError if it is missing or no whole numbers."""
        return np.asarray(self._numbers(name, "i"), np.int64)

    def lists(self, name: str, kind: type) -> list[NDArray[Any]]:
        """Return column `name`, a column of lists, as R arrays of number type `kind`; no rows give [].

        Raises InputError if the column is missing or no lists of such numbers.
        """
        column = self._get(name)
        if not isinstance(column, tuple) or column[0].dtype.kind != np.dtype(kind).kind:
            raise InputError(file=self.file, place=name, got="another column", expected="lists of numbers", remedy=REDO)
        values, ends = column
        return [np.asarray(v, kind) for v in np.split(values, ends[:-1])] if len(ends) else []

    def _numbers(self, name: str, kinds: str) -> NDArray[Any]:
        """Return column `name`; raise InputError if it is missing or numpy's kind of its type is not in `kinds`."""
        column = self._get(name)
        if isinstance(column, tuple) or column.dtype.kind not in kinds:
            got = "a column of lists" if isinstance(column, tuple) else f"a column of {column.dtype}"
            expected = "whole numbers" if kinds == "i" else "numbers"
            raise InputError(file=self.file, place=name, got=got, expected=expected, remedy=REDO)
        return np.asarray(column)

    def _get(self, name: str) -> Any:
        if name not in self.columns:
            raise InputError(file=self.file, got=f"no column {name}", expected="that column", remedy=REDO)
        return self.columns[name]

    def fact(self, name: str) -> Any:
        """Return the value `name` of the table's metadata. Raises InputError if it is missing."""
        if name not in self.facts:
            raise InputError(file=self.file, place="schema", got=f"no {name}", expected="that value", remedy=REDO)
        return self.facts[name]

    def count(self, name: str, limit: int) -> int:
        """Return the value `name` of the metadata, a whole number from 0 to `limit`; raise InputError for another."""
        value = self.fact(name)
        fits = isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= limit
        self.reject(not fits, name, repr(value), f"a whole number from 0 to {limit}")
        return int(value)

    def number(self, name: str, low: float, high: float) -> float:
        """Return the value `name` of the metadata, a number from `low` to `high`; raise InputError for another."""
        value = self.fact(name)
        self.reject(not is_number(value, low, high), name, repr(value), f"a number from {low:g} to {high:g}")
        return float(value)

    def frames(self, name: str) -> set[int]:
        """Return the value `name` of the metadata, a list of whole numbers, as a set; raise InputError for another.

        Whether they are frames of the table is not checked."""
        value = self.fact(name)
        fits = isinstance(value, list) and all(isinstance(v, int) for v in value)
        self.reject(not fits, name, repr(value), "a list of frames")
        return set(value)

    def cuts(self, first: int, count: int) -> Ints:
        """Return the index of the first row of each of `count` frames from `first` on, and of the end: (count + 1,).

        Raises InputError if the rows are not sorted by the column frame, or one is outside these frames.
        """
        frame = self.ints("frame")
        wrong = bool(len(frame)) and (frame.min() < first or frame.max() >= first + count or (np.diff(frame) < 0).any())
        self.reject(bool(wrong), "frame", "other frames", f"frames {first} to {first + count - 1}, in order")
        return np.searchsorted(frame, np.arange(first, first + count + 1))

    def reject(self, wrong: bool, place: str, got: str, expected: str) -> None:
        """Raise InputError about a place in this file if `wrong` is True; do nothing otherwise."""
        if wrong:
            raise InputError(file=self.file, place=place, got=got, expected=expected, remedy=REDO)


def table_bytes(columns: Iterable[Column], facts: dict[str, Any]) -> bytes:
    """Return a Parquet file as bytes; equal content gives equal bytes.

    columns: all of equal length. facts: metadata, stored as JSON in the schema together with our "format" (1). Raises
    ValueError if columns differ in length or `facts` holds NaN or infinity, TypeError if it holds what JSON cannot.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = list(columns)
    arrays = [_arrow(c) for c in columns]
    schema = pa.schema(
        [pa.field(c.name, a.type, metadata={"unit": c.unit}) for c, a in zip(columns, arrays, strict=True)],
        metadata={KEY: json_text({"format": FORMAT, **facts}).encode()},
    )
    sink = pa.BufferOutputStream()
    table = pa.Table.from_arrays(arrays, schema=schema)
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return bytes(sink.getvalue())


def _arrow(column: Column) -> Any:
    import pyarrow as pa

    if isinstance(column.values, np.ndarray):
        return pa.array(column.values)
    offsets = np.cumsum([0, *(len(v) for v in column.values)]).astype(np.int32)
    flat = np.concatenate([np.zeros(0, column.kind), *column.values])
    return pa.ListArray.from_arrays(pa.array(offsets), pa.array(flat))


def read_table(path: Path) -> StoredTable:
    """Read a Parquet table that table_bytes wrote.

    Raises InputError if the file is missing or damaged (a page differs from its checksum), was not written by
    table_bytes, has another format number, or holds nulls. NaN is no null.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    require_regular(path, REDO)
    try:
        table = pq.read_table(path, partitioning=None, page_checksum_verification=True)
        metadata = (table.schema.metadata or {}).get(KEY, b"{}").decode()
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        reason = f"no readable Parquet ({(str(error).splitlines() or [type(error).__name__])[0]})"
        raise InputError(file=path, got=reason, expected="a whole Parquet file", remedy=REDO) from None
    facts = parse_json(metadata, path, REDO)
    if not isinstance(facts, dict):
        raise InputError(file=path, place="schema", got="no JSON object", expected="a JSON object", remedy=REDO)
    if facts.get("format") != FORMAT:
        raise InputError(
            file=path, place="schema", got=f"format {facts.get('format')}", expected=f"format {FORMAT}", remedy=REDO
        )
    columns = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        if column.null_count:
            raise InputError(file=path, place=name, got="empty cells", expected="none", remedy=REDO)
        columns[name] = _numpy(column.combine_chunks())
    return StoredTable(path, columns, facts)


def is_own_table(path: Path) -> bool:
    """Return True if the Parquet table `path` was written by table_bytes; only its schema is read.

    Raises InputError if the file is no Parquet table, OSError if it cannot be read.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return KEY in (pq.read_schema(path).metadata or {})
    except pa.ArrowException:
        raise InputError(file=path, got="no Parquet table", expected="one", remedy=REDO) from None


def _numpy(column: Any) -> Any:
    import pyarrow as pa

    if pa.types.is_list(column.type):
        lengths = np.diff(column.offsets.to_numpy())
        return column.flatten().to_numpy(zero_copy_only=False), np.cumsum(lengths)
    return column.to_numpy(zero_copy_only=False)


def json_text(value: Any) -> str:
    """Return a value as JSON on one line, keys in their order; characters beyond ASCII stay as they are.

    Lone surrogates, which Python reads from names of files that are no UTF-8, are escaped. Raises ValueError for NaN
    and infinity, TypeError for a type that JSON does not have.
    """
    return _storable(json.dumps(value, ensure_ascii=False, allow_nan=False))


def _storable(text: str) -> str:
    """Return a JSON text with each lone surrogate as the six characters of its escape, so that it can be UTF-8."""
    return text.encode("utf-8", "backslashreplace").decode()


def json_document(value: dict[str, Any]) -> bytes:
    """Return a JSON file, indented by two blanks and ended by a line feed, as UTF-8 bytes.

    Raises ValueError for NaN and infinity, TypeError for a type that JSON does not have.
    """
    return (_storable(json.dumps(value, ensure_ascii=False, allow_nan=False, indent=2)) + "\n").encode()


def json_list(name: str, items: Iterable[dict[str, Any]]) -> bytes:
    """Return the JSON file {"format": 1, name: [items]} as UTF-8 bytes, with one item per line; without items the list
    is empty.

    Raises ValueError for NaN and infinity, TypeError for a type that JSON does not have.
    """
    lines = ",\n".join(json_text(item) for item in items)
    body = f"[\n{lines}\n]" if lines else "[]"
    return f'{{"format": {FORMAT}, "{name}": {body}}}\n'.encode()


def read_json(path: Path, remedy: str = REDO) -> dict[str, Any]:
    """Read the file `path`, which holds one JSON object, as a dict.

    remedy: for the error about a file that is no JSON object. Raises InputError if it is unreadable, no regular file,
    above 64 MB or no JSON object, holds NaN, is nested deeper than 32 levels, or has a whole number beyond 64 bits.
    """
    from sim.io.files.numeric_text import read_text

    value = parse_json(read_text(path, JSON_BYTES), path, remedy)
    if not isinstance(value, dict):
        raise InputError(file=path, got=type(value).__name__, expected="a JSON object", remedy=remedy)
    return value


def read_document(path: Path, remedy: str = REDO) -> dict[str, Any]:
    """Read a JSON object that we wrote, as a dict.

    remedy: for the error about a file that is no JSON object. A file without the key "format" is accepted. Raises
    InputError if the file is unreadable, no JSON object, or of another format number than 1.
    """
    value = read_json(path, remedy)
    found = value.get("format", FORMAT)
    if found != FORMAT or isinstance(found, bool):
        raise InputError(file=path, place="format", got=repr(found), expected=FORMAT, remedy="use the same version")
    return value


def nan_to_none(value: float) -> float | None:
    """Return the number `value` as it stands in JSON: None for nan, else a float. Infinity stays infinity."""
    return None if value != value else float(value)


def none_to_nan(value: float | None) -> float:
    """Return the number as read from JSON: nan for None, else a float."""
    return float("nan") if value is None else float(value)
