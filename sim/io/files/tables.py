"""Parquet tables with a unit at each column, and JSON documents: to bytes and, strictly, back."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim.types import Array, Ints

FORMAT = 1
KEY = b"flockscope"
REDO = "run the command that made it again"


@dataclass(frozen=True)
class Column:
    """A column: values (R,), or a list of arrays of `kind` for a column of lists; unit as in the schema."""

    name: str
    values: NDArray[Any] | list[NDArray[Any]]
    unit: str = "1"
    kind: type = np.float64


@dataclass(frozen=True)
class StoredTable:
    """A table as read: columns by name, and the facts stored with it."""

    file: Path
    columns: dict[str, Any]
    facts: dict[str, Any]

    def has(self, name: str) -> bool:
        """Whether there is such a column."""
        return name in self.columns

    def floats(self, *names: str) -> Array:
        """(R,) of one column, (R, n) of several."""
        found = [np.asarray(self._get(name), np.float64) for name in names]
        return found[0] if len(found) == 1 else np.stack(found, axis=1)

    def ints(self, name: str) -> Ints:
        """(R,) ids or frames."""
        return np.asarray(self._get(name), np.int64)

    def lists(self, name: str, kind: type) -> list[NDArray[Any]]:
        """The arrays of a column of lists."""
        values, ends = self._get(name)
        return [np.asarray(v, kind) for v in np.split(values, ends[:-1])] if len(ends) else []

    def _get(self, name: str) -> Any:
        if name not in self.columns:
            raise InputError(file=self.file, got=f"no column {name}", expected="one", remedy=REDO)
        return self.columns[name]

    def fact(self, name: str) -> Any:
        """A stored fact; InputError where it is missing."""
        if name not in self.facts:
            raise InputError(file=self.file, place="schema", got=f"no {name}", expected="one", remedy=REDO)
        return self.facts[name]


def table_bytes(columns: Iterable[Column], facts: dict[str, Any]) -> bytes:
    """A Parquet file; the same content gives the same bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = list(columns)
    arrays = [_arrow(c) for c in columns]
    schema = pa.schema(
        [pa.field(c.name, a.type, metadata={"unit": c.unit}) for c, a in zip(columns, arrays, strict=True)],
        metadata={KEY: json_text({"format": FORMAT, **facts}).encode()},
    )
    sink = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), sink, compression="zstd")
    return bytes(sink.getvalue())


def _arrow(column: Column) -> Any:
    import pyarrow as pa

    if isinstance(column.values, np.ndarray):
        return pa.array(column.values)
    offsets = np.cumsum([0, *(len(v) for v in column.values)]).astype(np.int32)
    flat = np.concatenate([np.zeros(0, column.kind), *column.values])
    return pa.ListArray.from_arrays(pa.array(offsets), pa.array(flat))


def read_table(path: Path) -> StoredTable:
    """A table of ours; InputError where it is truncated, another's, or holds nulls."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path, partitioning=None)
    except (pa.ArrowException, OSError) as error:
        reason = "nothing there" if not path.exists() else f"no readable Parquet ({str(error).splitlines()[0]})"
        raise InputError(file=path, got=reason[:160], expected="a whole Parquet file", remedy=REDO) from None
    facts = json.loads((table.schema.metadata or {}).get(KEY, b"{}"))
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


def _numpy(column: Any) -> Any:
    import pyarrow as pa

    if pa.types.is_list(column.type):
        lengths = np.diff(column.offsets.to_numpy())
        return column.flatten().to_numpy(zero_copy_only=False), np.cumsum(lengths)
    return column.to_numpy(zero_copy_only=False)


def json_text(value: Any) -> str:
    """JSON on one line, keys in the order given, no NaN."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def json_document(value: dict[str, Any]) -> bytes:
    """A JSON file for reading: two blanks of indentation, a newline at the end."""
    return (json.dumps(value, ensure_ascii=False, allow_nan=False, indent=2) + "\n").encode()


def json_list(name: str, items: Iterable[dict[str, Any]]) -> bytes:
    """{"format": 1, name: [...]} with one item per line."""
    lines = ",\n".join(json_text(item) for item in items)
    body = f"[\n{lines}\n]" if lines else "[]"
    return f'{{"format": {FORMAT}, "{name}": {body}}}\n'.encode()


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object; InputError with the line where it is none."""
    from sim.io.files.numeric_text import read_text

    try:
        value = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(
            file=path, place=f"line {error.lineno}", got=f"no JSON ({error.msg})", expected="a JSON object", remedy=REDO
        ) from None
    if not isinstance(value, dict):
        raise InputError(file=path, got=type(value).__name__, expected="a JSON object", remedy=REDO)
    return value


def read_document(path: Path) -> dict[str, Any]:
    """A JSON object of ours; InputError where it says another format (one that says none is taken as ours)."""
    value = read_json(path)
    said = value.get("format", FORMAT)
    if said != FORMAT or isinstance(said, bool):
        raise InputError(file=path, place="format", got=said, expected=FORMAT, remedy="use the same version")
    return value


def nan_to_none(value: float) -> float | None:
    """A number for JSON: None for nan."""
    return None if value != value else float(value)


def none_to_nan(value: float | None) -> float:
    """A number from JSON: nan for None."""
    return float("nan") if value is None else float(value)
