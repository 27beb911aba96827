"""Validates a plain table as a Scenario or another pydantic model, and reports the first problem as an InputError of
one line.
"""

from __future__ import annotations

import typing
from typing import Any

from pydantic import BaseModel, ValidationError

from scenarios.errors import InputError, counted
from scenarios.limits import COORDINATE, is_number
from scenarios.loading.toml_files import KeyPath, Table, did_you_mean, place_of

# of the discriminators of values, in pydantic's locations
TAGS = {"number", "distribution", "schedule", "point", "meet"}
# What is expected, by the type of pydantic's error and its context.
EXPECTED = {
    "bool_type": "true or false", "int_type": "an integer", "float_type": "a number", "string_type": "a text",
    "string_pattern_mismatch": "a name: a letter, then letters, digits, '_', '.' or '-'", "model_type": "a table",
    "finite_number": "a finite number", "model_attributes_type": "a table", "literal_error": "{expected}",
    "tuple_type": "a list, see docs/reference/scenario-files.md", "value_error": "{error}",
    "too_short": "a length of at least {min_length}", "too_long": "a length of at most {max_length}",
    "greater_than": "greater than {gt:g}", "greater_than_equal": "greater than or equal to {ge:g}",
    "less_than_equal": "less than or equal to {le:g}", "union_tag_invalid": "`type`, one of {expected_tags}",
    "union_tag_not_found": "`type`, one of 'merge', 'split', 'queue'",
}  # fmt: skip

M = typing.TypeVar("M", bound=BaseModel)


def validate(table: Table, file: object = "", places: dict[KeyPath, str] | None = None, *, model: type[M]) -> M:
    """Returns the table as a `model`; raises InputError for the first problem. Types are not converted.

    places: texts of settings by path, from `apply_settings`; an error at or below such a path names the setting.
    """

    def wrong(path: KeyPath, got: object, expected: str, remedy: str) -> InputError:
        place = _place(path, table, places or {})
        return InputError(file=file, place=place, got=got, expected=expected, remedy=remedy)

    def plain(value: Any, path: KeyPath = ()) -> Any:
        if isinstance(value, dict):
            return {key: plain(inner, (*path, key)) for key, inner in value.items()}
        if isinstance(value, list):  # pydantic's strict mode takes no list for a tuple
            return tuple(plain(inner, (*path, k)) for k, inner in enumerate(value))
        if is_number(value) and abs(value) > COORDINATE:
            raise wrong(path, value, f"a number within {COORDINATE:g}", "correct the value")
        return value

    try:
        return model.model_validate(plain(table), strict=True)
    except ValidationError as error:
        problems = list(error.errors(include_url=False))
    # A list of wrong items counts as too short, too.
    found = [e for e in problems if e["type"] != "too_short"] or problems
    # Unknown keys come first, because a misspelt key explains a missing one.
    first = min(found, key=lambda e: e["type"] != "unknown_key")
    path = path_of(first["loc"])
    more = f" ({counted(len(found) - 1, 'more problem')})" if len(found) > 1 else ""
    path, got, expected, remedy = _words(first, path)
    raise wrong(path, got, expected, remedy + more)


def path_of(loc: KeyPath) -> KeyPath:
    """Returns the path in a scenario's table of a location in pydantic's errors, which names kinds of values, too."""
    kinds = loc[:1] == ("event",) or loc[:2] == ("camera", "motion")
    return tuple(s for k, s in enumerate(loc) if s not in TAGS and not (k == 2 and kinds))


def _words(error: Any, path: KeyPath) -> tuple[KeyPath, str, str, str]:
    """Returns the place, what was found, what was expected and a remedy."""
    kind, ctx, got = error["type"], error.get("ctx", {}), _show(error["input"])
    if kind == "problem":
        return path, ctx["got"], ctx["expected"], ctx["remedy"]
    if kind == "unknown_key":
        return (*path, ctx["key"]), f"unknown key {ctx['key']!r}", "a known key", did_you_mean(ctx["key"], ctx["known"])
    if kind == "missing" and isinstance(path[-1], int):
        return path, got, f"at least {path[-1] + 1} numbers", "correct the list"
    if kind == "missing":
        return path, "nothing", f"the key {str(path[-1])!r}", "add it"
    expected = EXPECTED[kind].format(**ctx) if kind in EXPECTED else error["msg"]
    return path, got, expected, "correct the value"


def _show(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_show, value)) + "]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_show(v)}" for key, v in value.items() if v is not None) + " }"
    return repr(value) if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value)


def _place(path: KeyPath, table: Table, places: dict[KeyPath, str]) -> str:
    """Returns the setting that made the value at a path, else the path as a dotted key; rows appear by their id."""
    given = [places[path[:n]] for n in range(len(path), 0, -1) if path[:n] in places]
    if given:
        return place_of(given[0])
    here: Any = table
    steps = []
    for step in path:
        inside = step in here if isinstance(here, dict) else isinstance(here, list) and step in range(len(here))
        here = here[step] if inside else None
        named = isinstance(step, int) and isinstance(here, dict) and isinstance(here.get("id"), str)
        steps.append(here["id"] if named else str(step))
    return ".".join(steps)
