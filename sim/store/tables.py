"""The project's Parquet tables and JSON files, to bytes and strictly back.

Each column of a table has a unit, and the table has metadata in its schema. Equal content gives equal bytes. nan is
null in JSON. pydantic models say what the values of a JSON file must be, so that a reader never meets a value of
another kind.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, ValidationError, create_model

from scenarios.errors import InputError, reject
from scenarios.limits import COORDINATE, FRAME_RATES, FRAMES, INTEGER, JSON_BYTES, SCALES
from scenarios.reading import parse_json, require_regular
from sim.types import Array, Ints

M = TypeVar("M", bound=BaseModel)

# Numbers of JSON files. pydantic takes lists for tuples; numbers are strict, so that no text or bool is one.
Number = Annotated[float, Field(strict=True, ge=-COORDINATE, le=COORDINATE)]
Rate = Annotated[float, Field(strict=True, ge=FRAME_RATES[0], le=FRAME_RATES[1])]  # frames per second
Scale = Annotated[float, Field(strict=True, ge=SCALES[0], le=SCALES[1])]  # px per m
FrameNumber = Annotated[int, Field(strict=True, ge=1, le=FRAMES)]
Count = Annotated[int, Field(strict=True, ge=0, le=FRAMES)]  # of frames
Id = Annotated[int, Field(strict=True, ge=0, le=INTEGER)]
PLANES = Literal["ground", "space", "image"]
Pair = tuple[Number, Number]
Triple = tuple[Number, Number, Number]


def validated(path: Path, value: Any, kind: type[M], remedy: str, place: str = "") -> M:
    """Returns a value read from JSON as the model `kind`; raises InputError for the first wrong place in it."""
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        first = error.errors()[0]
    steps = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in first["loc"])
    got = "nothing" if first["type"] == "missing" else repr(first["input"])
    expected = first["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
    expected = "a value" if first["type"] == "missing" else expected
    raise InputError(file=path, place=(place + steps).removeprefix("."), got=got, expected=expected, remedy=remedy)


@cache
def model(**kinds: Any) -> type[BaseModel]:
    """Returns the model of values by key. kinds: of each its type, or its type and what stands for a missing one."""
    values: Any = {name: kind if isinstance(kind, tuple) else (kind, ...) for name, kind in kinds.items()}
    return create_model("Values", **values)


FORMAT = 1
KEY = b"flockscope"
REDO = "run the command that made it again"


# names of columns of several tables
AXES = ("x", "y", "z")
SIDES = ("left", "top", "width", "height")
BOX, VISIBLE, MODAL = (tuple(f"{kind}_{side}" for side in SIDES) for kind in ("box", "visible", "modal"))
EXTENT = ("extent_xx", "extent_xy", "extent_yx", "extent_yy")
# values by the name of a column: an array (R,), or lists as a pyarrow.Array; by a tuple of n names: an array (R, n); a
# column that is None is left out
Columns = Mapping[Any, Any]


def along(axes: Iterable[str]) -> tuple[str, ...]:
    """Returns the names of the columns of velocities along axes."""
    return tuple(f"v{axis}" for axis in axes)


def units_of(unit: str) -> dict[str, str]:
    """Returns the units of the columns of stored tables by name. unit: of positions, "m" or "px"."""
    state = dict.fromkeys(AXES, unit) | dict.fromkeys(along(AXES), f"{unit}/s")
    covariances = {f"cov_{a}_{b}": f"{state[a]} {state[b]}" for a in state for b in state}
    boxes = dict.fromkeys((*BOX, *VISIBLE, *MODAL), "px") | {"visible_px": "px²", "amodal_px": "px²"}
    groups = dict.fromkeys(EXTENT, f"{unit}^2") | {"size": "people", "hull": f"{unit}: x1, y1, x2, …"}
    return {**state, **covariances, **boxes, **groups, "heading": "rad", "height": "m"}


@dataclass(frozen=True)
class StoredTable:
    """A Parquet table of R rows as read from `file`."""

    file: Path
    columns: dict[str, NDArray[Any]]  # by name an array (R,), of a column of lists an array of R arrays
    facts: dict[str, Any]  # the metadata that was stored with the table, by name, and "format"

    def floats(self, *names: str) -> Array:
        """Returns the columns `names` as float64: one as (R,), n > 1 as (R, n)."""
        found = [np.asarray(self._numbers(name, "iufb", "numbers"), np.float64) for name in names]
        return found[0] if len(found) == 1 else np.stack(found, axis=1)

    def known(self, *names: str) -> Array | None:
        """Returns what `floats` does; None if there is no such column."""
        return self.floats(*names) if names[0] in self.columns else None

    def ints(self, name: str) -> Ints:
        """Returns column `name` as (R,), int64."""
        return np.asarray(self._numbers(name, "i", "whole numbers"), np.int64)

    def lists(self, name: str, kind: type) -> list[NDArray[Any]]:
        """Returns column `name`, whose cells are lists, as R arrays of number type `kind`."""
        column, wanted = self._numbers(name, "O", "lists of numbers"), np.dtype(kind).kind
        other = any(not isinstance(v, np.ndarray) or v.dtype.kind != wanted for v in column)
        self.reject(other, name, "another column", "lists of numbers")
        return [np.asarray(v, kind) for v in column]

    def _numbers(self, name: str, kinds: str, expected: str) -> NDArray[Any]:
        reject(name not in self.columns, self.file, f"no column {name}", "that column", REDO)
        column = self.columns[name]
        self.reject(column.dtype.kind not in kinds, name, f"a column of {column.dtype}", expected)
        return column

    def facts_as(self, **kinds: Any) -> Any:
        """Returns the table's metadata as attributes; raises InputError for wrong values. kinds: as of `model`."""
        return validated(self.file, self.facts, model(**kinds), REDO, "schema")

    def cuts(self, first: int, count: int) -> list[slice]:
        """Returns the rows of each of `count` frames from `first` on."""
        frame = self.ints("frame")
        wrong = bool(len(frame)) and (frame.min() < first or frame.max() >= first + count or (np.diff(frame) < 0).any())
        self.reject(bool(wrong), "frame", "other frames", f"frames {first} to {first + count - 1}, in order")
        return [slice(*cut) for cut in pairwise(np.searchsorted(frame, np.arange(first, first + count + 1)).tolist())]

    def reject(self, wrong: bool, place: str, got: str, expected: str) -> None:
        """Raises InputError about a place in this file if `wrong` is True."""
        reject(wrong, self.file, got, expected, REDO, place)


def table_bytes(columns: Columns, facts: dict[str, Any], units: Mapping[str, str]) -> bytes:
    """Returns a Parquet file as bytes; `facts` is metadata in its schema. Equal content gives equal bytes.

    units: of columns, by name; columns that are not in it have none.
    """
    import pyarrow as pa

    arrays: dict[str, Any] = {}
    for names, values in columns.items():
        if values is not None:
            several = zip(names, values.T, strict=True) if isinstance(names, tuple) else [(names, values)]
            arrays |= {name: pa.array(column) for name, column in several}
    schema = pa.schema([pa.field(name, a.type, metadata={"unit": units.get(name, "1")}) for name, a in arrays.items()])
    return parquet_bytes(pa.Table.from_arrays(list(arrays.values()), schema=schema), facts)


def parquet_bytes(table: Any, facts: Mapping[str, Any]) -> bytes:
    """Returns a pyarrow.Table as the bytes of a Parquet file that `is_own_table` recognises. facts: its metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    sink = pa.BufferOutputStream()
    marked = table.replace_schema_metadata({KEY: json_text({"format": FORMAT, **facts}).encode()})
    # Checksums of pages: a damaged file is an error, and not other numbers.
    pq.write_table(marked, sink, compression="zstd", write_page_checksum=True)
    return bytes(sink.getvalue())


def read_table(path: Path) -> StoredTable:
    """Reads a Parquet table that `table_bytes` wrote; raises InputError for any other file and for a damaged one."""
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
    found = StoredTable(path, {}, facts)
    found.reject(not isinstance(facts, dict), "schema", "no JSON object", "a JSON object")
    found.reject(facts.get("format") != FORMAT, "schema", f"format {facts.get('format')}", f"format {FORMAT}")
    for name, column in zip(table.column_names, table.columns, strict=True):
        found.reject(column.null_count > 0, name, "empty cells", "none")
        found.columns[name] = column.to_numpy()
    return found


def is_own_table(path: Path) -> bool:
    """Returns True if flockscope wrote the Parquet table `path`; only its schema is read. No Parquet: InputError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return KEY in (pq.read_schema(path).metadata or {})
    except pa.ArrowException:
        raise InputError(file=path, got="no Parquet table", expected="one", remedy=REDO) from None


def plain(value: Any) -> Any:
    """Returns a value as JSON has it: arrays, tuples and ranges as lists, dataclasses as dicts, paths as text, nan and
    infinity as None."""
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, tuple | list | range):
        return [plain(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any) -> str:
    """Returns a value as JSON on one line, keys in their order; characters beyond ASCII stay as they are."""
    return _storable(json.dumps(value, ensure_ascii=False, allow_nan=False))


def _storable(text: str) -> str:
    # Lone surrogates, from file names that are no UTF-8, become the six characters of their escape.
    return text.encode("utf-8", "backslashreplace").decode()


def json_document(value: dict[str, Any]) -> bytes:
    """Returns the content of a JSON file, UTF-8 bytes indented by two blanks, for a dict."""
    return (_storable(json.dumps(value, ensure_ascii=False, allow_nan=False, indent=2)) + "\n").encode()


def json_list(name: str, items: Iterable[dict[str, Any]]) -> bytes:
    """Returns the content of a JSON file {"format": 1, name: [items]} as UTF-8 bytes, one item per line."""
    lines = ",\n".join(json_text(item) for item in items)
    body = f"[\n{lines}\n]" if lines else "[]"
    return f'{{"format": {FORMAT}, "{name}": {body}}}\n'.encode()


def read_json(path: Path, remedy: str = REDO) -> dict[str, Any]:
    """Returns the JSON object in the file `path` as a dict; raises InputError if there is none."""
    from sim.store.numeric_text import read_text

    value = parse_json(read_text(path, JSON_BYTES), path, remedy)
    reject(not isinstance(value, dict), path, type(value).__name__, "a JSON object", remedy)
    found: dict[str, Any] = value
    return found


def read_document(path: Path, remedy: str = REDO) -> dict[str, Any]:
    """Returns the JSON object in a file of ours; InputError for another "format" than 1, which may be missing."""
    value = read_json(path, remedy)
    found = value.get("format", FORMAT)
    other = found != FORMAT or isinstance(found, bool)
    reject(other, path, repr(found), FORMAT, "use the same version", "format")
    return value


def read_values(path: Path, remedy: str, no_json: str = REDO, /, **kinds: Any) -> Any:
    """Returns the values of a JSON file of ours as attributes; raises InputError for wrong ones. kinds: as of `model`.

    remedy: for a wrong value. no_json: for a file that is no JSON object.
    """
    return validated(path, read_document(path, no_json), model(**kinds), remedy)


def none_to_nan(value: float | None) -> float:
    """Returns a number of a JSON file as float; None, which stands for nan there, as nan."""
    return float("nan") if value is None else float(value)
