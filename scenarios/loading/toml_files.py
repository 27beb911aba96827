"""Scenario files as plain tables: where they lie, TOML, `extends`, and the rule by which two tables merge.

A file that says `extends = "base.toml"` (relative to itself, else in the catalogue) is laid over its base:

- tables merge key by key, everything else replaces;
- arrays of tables with `id` (group, event, parts) merge by id: known ids merge, new ones are appended;
- a distribution and a `when` are values, not tables: they replace whole;
- `name` is not inherited.
"""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Protocol

from scenarios.errors import InputError

CATALOGUE = Path(__file__).parents[1]
SUITES = CATALOGUE / "suites"
DISTRIBUTION_KEYS = frozenset({"normal", "uniform", "exponential", "poisson", "choice", "clip"})

Table = dict[str, Any]


def names() -> list[str]:
    """The scenarios of the catalogue, sorted."""
    return sorted(path.stem for path in CATALOGUE.glob("*.toml"))


def suite_names() -> list[str]:
    """The suites of the catalogue, sorted."""
    return sorted(path.stem for path in SUITES.glob("*.toml"))


def nearest(word: str, known: list[str]) -> str:
    """Which of the known names may have been meant, as the remedy of an error."""
    close = difflib.get_close_matches(word, known, n=3, cutoff=0.5)
    if close:
        return "did you mean " + " or ".join(repr(name) for name in close) + "?"
    return "choose one of " + ", ".join(known) if known else "there is none to choose from"


def closest(word: str, known: Iterable[str]) -> str:
    """The known name that is most like a word, whatever their cases; "" where nothing is known."""
    names = {name.casefold(): name for name in known}
    return names[difflib.get_close_matches(word.casefold(), names, 1, 0.0)[0]] if names else ""


def find(name: str | Path, beside: Path | None = None) -> Path:
    """The file of a `*.toml` path (relative to the folder `beside`, else to the catalogue) or of a catalogue name."""
    text = str(name)
    if not text.endswith(".toml"):
        path = CATALOGUE / f"{text}.toml"
        if text in names():
            return path
        raise InputError(got=repr(text), expected="a scenario's name or a *.toml file", remedy=nearest(text, names()))
    for folder in (beside or Path(), CATALOGUE):
        if (folder / text).is_file():
            return folder / text
    raise InputError(
        file=text, got="no such file", expected="a scenario file", remedy="check the path, or name a scenario"
    )


def parse(path: Path) -> Table:
    """One TOML file as it stands."""
    try:
        return tomllib.loads(path.read_bytes().decode())
    except tomllib.TOMLDecodeError as error:
        message, _, place = str(error).rpartition(" (at ")
        raise InputError(
            file=path,
            place=place.rstrip(")"),
            got=message or str(error),
            expected="TOML",
            remedy="correct the line; strings want quotes, tables inside a line want { }",
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            file=path,
            place=f"byte {error.start}",
            got="bytes that are not UTF-8",
            expected="TOML",
            remedy="save as UTF-8",
        ) from None
    except OSError as error:
        raise InputError(
            file=path, got=error.strerror or error, expected="a readable file", remedy="check path and rights"
        ) from None


def read(path: Path, chain: tuple[Path, ...] = ()) -> Table:
    """One file with everything it extends merged in; `name` is the file's where it gives none."""
    chain = (*chain, path.resolve())
    table = parse(path)
    base = table.pop("extends", None)
    if base is None:
        return {**table, "name": table.get("name", path.stem)}
    if not isinstance(base, str):
        raise InputError(file=path, place="extends", got=repr(base), expected="a file's name", remedy="quote it")
    base_path = _base(path, base)
    if base_path.resolve() in chain:
        circle = " → ".join(p.name for p in (*chain, base_path))
        raise InputError(
            file=path, place="extends", got=circle, expected="an end of the chain", remedy="take one `extends` out"
        )
    return {**merge(read(base_path, chain), table), "name": table.get("name", path.stem)}


def _base(path: Path, base: str) -> Path:
    try:
        return find(base, beside=path.parent)
    except InputError as error:
        raise InputError(
            file=path, place="extends", got=repr(base), expected=error.expected, remedy=error.remedy
        ) from None


def merge(below: Table, above: Table) -> Table:
    """`above` laid over `below`, by the rule in this module's docstring; neither is changed."""
    merged = dict(below)
    for key, value in above.items():
        merged[key] = _merge_value(key, below.get(key), value)
    return merged


def _merge_value(key: str, below: Any, above: Any) -> Any:
    if isinstance(below, dict) and isinstance(above, dict) and not _is_value(key, above):
        return merge(below, above)
    if _has_ids(below) and _has_ids(above):
        return _merge_by_id(below, above)
    return above


def _is_value(key: str, table: Table) -> bool:
    return key == "when" or (bool(table) and table.keys() <= DISTRIBUTION_KEYS)


def _has_ids(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) and "id" in row for row in value)


def _merge_by_id(below: list[Table], above: list[Table]) -> list[Table]:
    rows = list(below)
    for row in above:
        place = next((k for k, old in enumerate(below) if old["id"] == row["id"]), None)
        if place is None:
            rows.append(row)
        else:
            rows[place] = merge(rows[place], row)
    return rows


class _Dumps(Protocol):
    """A pydantic model; a protocol, because this module does without importing pydantic."""

    def model_dump(self, *, mode: str, by_alias: bool, exclude_none: bool) -> dict[str, Any]: ...


def dump(scenario: _Dumps) -> str:
    """The scenario, or another form of such tables, as TOML text."""
    table = scenario.model_dump(mode="python", by_alias=True, exclude_none=True)
    flat = [(k, v) for k, v in table.items() if not _is_table(v) and not _is_rows(v)]
    blocks = [_lines(dict(flat))]
    for key, value in table.items():
        if _is_table(value):
            blocks.append(f"[{key}]\n" + _lines(value))
        elif _is_rows(value):
            blocks += [f"[[{key}]]\n" + _lines(row) for row in value]
    return "\n".join(blocks)


def _is_table(value: Any) -> bool:
    return isinstance(value, dict)


def _is_rows(value: Any) -> bool:
    return isinstance(value, tuple) and bool(value) and isinstance(value[0], dict)


def _lines(table: dict[str, Any]) -> str:
    return "".join(f"{key} = {toml_value(v)}\n" for key, v in table.items())


def toml_value(v: Any) -> str:
    """A value as TOML, on one line."""
    if isinstance(v, bool):
        return str(v).lower()
    if isinstance(v, str):
        return json.dumps(v, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{key} = {toml_value(inner)}" for key, inner in v.items()) + " }"
    if isinstance(v, tuple | list):
        return "[" + ", ".join(map(toml_value, v)) + "]"
    return repr(v)
