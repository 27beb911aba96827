"""Validates a plain table as a Scenario or another pydantic model, and reports the first problem as an InputError of
one line.
"""

from __future__ import annotations

import re
import typing
from typing import Any

from pydantic import BaseModel, ValidationError

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, is_number
from scenarios.loading.toml_files import KeyPath, Table, did_you_mean, place_of

# words for what pydantic expects, by its kind of error
EXPECTED = {
    "float_type": "a number, or a distribution such as { normal = [1.3, 0.2] }",
    "literal_error": "a point [x, y] in metres, or ",
    "string_pattern_mismatch": "a name: a letter, then letters, digits, '_', '.' or '-'",
}
TAGS = {"number", "distribution", "point", "word"}  # of the discriminators of values, in pydantic's locations

M = typing.TypeVar("M", bound=BaseModel)


def validate(table: Table, file: object = "", places: dict[KeyPath, str] | None = None, *, model: type[M]) -> M:
    """Returns the table as a model; raises InputError for the first problem. Types are strict.

    places: texts of `--set` by path, as of `apply_settings`; an error at or below such a path names the setting.
    """
    for path, number in _numbers(table):
        if abs(number) > COORDINATE:
            raise InputError(
                file=file, place=_place(path, table, places or {}), got=number,
                expected=f"a number within {COORDINATE:g}", remedy="correct the value",
            )  # fmt: skip
    try:
        return model.model_validate(_tuples(table), strict=True)
    except ValidationError as error:
        raise input_error(error, table, file, places or {}) from None


def _numbers(value: Any, path: KeyPath = ()) -> typing.Iterator[tuple[KeyPath, float]]:
    """Yields every finite number in a table with its path."""
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _numbers(inner, (*path, key))
    elif is_number(value):
        yield path, value


def _tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tuples(v) for key, v in value.items()}
    # pydantic's strict mode takes no list for a tuple.
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value


def input_error(error: ValidationError, table: Table, file: object, places: dict[KeyPath, str]) -> InputError:
    """Returns the error for the first problem that pydantic found, and says how many more there are."""
    found = list(error.errors(include_url=False))
    # Unknown keys come first, because a misspelt key explains a missing one.
    first = min(found, key=lambda e: (e["type"] != "unknown_key", e["type"] == "too_short" and len(found) > 1))
    path = tuple(s for k, s in enumerate(first["loc"]) if s not in TAGS and not (k == 2 and first["loc"][0] == "event"))
    if first["type"] == "unknown_key":
        path += (first["ctx"]["key"],)
    elif first["type"].startswith("union_tag"):
        path += ("type",)
    got, expected, remedy = _words(first, path)
    more = f" ({len(found) - 1} more problem{'s' * (len(found) > 2)})" if len(found) > 1 else ""
    return InputError(file=file, place=_place(path, table, places), got=got, expected=expected, remedy=remedy + more)


def _words(error: Any, path: KeyPath) -> tuple[str, str, str]:
    """Returns what was found, what was expected and a remedy."""
    kind, message, ctx, got = error["type"], str(error["msg"]), error.get("ctx", {}), _show(error["input"])
    if kind == "problem":
        return ctx["got"], ctx["expected"], ctx["remedy"]
    if kind == "unknown_key":
        key = str(ctx["key"])
        return f"unknown key {key!r}", "a known key", did_you_mean(key, ctx["known"])
    if kind == "missing" and isinstance(path[-1], int):
        return got, f"at least {path[-1] + 1} numbers", "correct the list"
    if kind == "missing":
        return "nothing", f"the key {str(path[-1])!r}", "add it"
    if kind == "union_tag_not_found":
        return "an event without `type`", "one of 'merge', 'split', 'queue'", "add `type`"
    if kind == "union_tag_invalid":
        return repr(ctx["tag"]), f"one of {ctx['expected_tags']}", "correct `type`"
    if kind in ("too_short", "too_long"):
        limit = ctx.get("min_length", ctx.get("max_length"))
        return got, f"at {'least' if kind == 'too_short' else 'most'} {limit} items", "correct the list"
    message = re.sub("^(Input should be |Value error, )", "", message)
    if kind == "literal_error" and "word" in error["loc"]:
        return got, EXPECTED[kind] + message, "correct the value"
    if kind == "string_pattern_mismatch" or (kind == "float_type" and "number" in error["loc"]):
        return got, EXPECTED[kind], "correct the value"
    message = re.sub(r"a valid dictionary or instance of \w+", "a table", message.replace("a valid tuple", "a list"))
    return got, message, "correct the value"


def _show(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_show, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_show(v)}" for key, v in value.items() if v is not None) + " }"
    return repr(value) if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value)


def _place(path: KeyPath, table: Table, places: dict[KeyPath, str]) -> str:
    """Returns the setting that made the value at a path, else the path as a dotted key; rows appear by their id."""
    for n in range(len(path), 0, -1):
        if path[:n] in places:
            return place_of(places[path[:n]])
    here: Any = table
    steps = []
    for step in path:
        if isinstance(here, list) and isinstance(step, int) and step < len(here):
            here = here[step]
        else:
            here = here.get(step) if isinstance(here, dict) else None
        named = isinstance(step, int) and isinstance(here, dict) and isinstance(here.get("id"), str)
        steps.append(here["id"] if named else str(step))
    return ".".join(steps)
