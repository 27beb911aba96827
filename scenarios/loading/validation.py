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
from scenarios.loading.overrides import KeyPath, place_of
from scenarios.loading.toml_files import Table, did_you_mean
from scenarios.schema.scenario import Scenario

NUMBER = "a number, or a distribution such as { normal = [1.3, 0.2] }"
NAME = "a name: a letter, then letters, digits, '_', '.' or '-'"
REPLACED = {
    "noise_px": "errors of boxes are shares of their height: set box_noise.scale (1 = default, 0 = none), or across, "
    "foot, top and width of box_noise"
}
"""Remedies for keys that other keys have replaced."""


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
        raise input_error(error, table, file, places or {}, model) from None


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


def input_error(
    error: ValidationError, table: Table, file: object, places: dict[KeyPath, str], model: type[BaseModel] = Scenario
) -> InputError:
    """Returns the error for the first problem that pydantic found, and says how many more there are."""
    # pydantic reports each branch of a union; those for another kind of value say nothing.
    found = [e for e in error.errors() if _branch_fits(e["loc"], table)] or list(error.errors())
    # Unknown keys come first, because a misspelt key explains a missing one.
    first = min(found, key=lambda e: (e["type"] != "extra_forbidden", e["type"] == "too_short" and len(found) > 1))
    path = table_path(first["loc"], table) + (("type",) if first["type"].startswith("union_tag") else ())
    got, expected, remedy = _words(first, path, table, model)
    more = f" ({len(found) - 1} more problem{'s' * (len(found) > 2)})" if len(found) > 1 else ""
    return InputError(file=file, place=_place(path, table, places), got=got, expected=expected, remedy=remedy + more)


def table_path(loc: tuple[int | str, ...], table: Table) -> KeyPath:
    """Returns a pydantic location as a path into the table, without the names of union branches."""
    return tuple(step for step, _, is_tag in _walk(loc, table) if not is_tag)


def _walk(loc: tuple[int | str, ...], table: Any) -> typing.Iterator[tuple[int | str, Any, bool]]:
    """Yields each step of a pydantic location, the value it starts from, and True if it only names a union branch."""
    here = table
    for k, step in enumerate(loc):
        last = k == len(loc) - 1
        if isinstance(here, dict) and (step in here or (last and not _is_branch(step))):
            yield step, here, False
            here = here.get(step)
        elif isinstance(here, list) and isinstance(step, int):
            yield step, here, False
            here = here[step] if step < len(here) else None
        else:
            yield step, here, True


def _is_branch(step: int | str) -> bool:
    return isinstance(step, str) and (step == "float" or "[" in step or step == "Distribution")


def _branch_fits(loc: tuple[int | str, ...], table: Table) -> bool:
    for step, value, is_tag in _walk(loc, table):
        if not is_tag or not isinstance(step, str):
            continue
        kind = (
            dict
            if "Distribution" in step and not step.startswith("tuple")
            else list
            if step.startswith("tuple")
            else None
        )
        if kind is not None and not isinstance(value, kind):
            return False
        if (step == "float" and isinstance(value, dict)) or (step.startswith("literal") and isinstance(value, list)):
            return False
    return True


def _words(error: Any, path: KeyPath, table: Table, model: type[BaseModel]) -> tuple[str, str, str]:
    kind, message = error["type"], str(error["msg"])
    if kind == "extra_forbidden":
        known = known_keys(path[:-1], table, model)
        key = str(path[-1])
        return f"unknown key {key!r}", "a known key", REPLACED.get(key) or did_you_mean(key, known)
    got = _show(error["input"])
    if kind == "missing" and isinstance(path[-1], int):
        return got, f"at least {path[-1] + 1} numbers", "correct the list"
    if kind == "missing":
        return "nothing", f"the key {str(path[-1])!r}", "add it"
    if kind == "union_tag_not_found":
        return "an event without `type`", "one of 'merge', 'split', 'queue'", "add `type`"
    if kind == "union_tag_invalid":
        return repr(error["ctx"]["tag"]), f"one of {error['ctx']['expected_tags']}", "correct `type`"
    if kind == "float_type" and "float" in error["loc"]:
        return got, NUMBER, "correct the value"
    if kind == "string_pattern_mismatch":
        return got, NAME, "rename it"
    if kind in ("too_short", "too_long"):
        limit = error["ctx"].get("min_length", error["ctx"].get("max_length"))
        return got, f"at {'least' if kind == 'too_short' else 'most'} {limit} items", "correct the list"
    if any(str(step).startswith("literal") for step in error["loc"]):
        return got, "a point [x, y] in metres, or " + message.removeprefix("Input should be "), "correct the value"
    return got, _expectation(message), "correct the value"


def _expectation(message: str) -> str:
    for start in ("Input should be ", "Value error, "):
        message = message.removeprefix(start)
    message = re.sub(r"^.* exactly one of (.*), not \[.*\]$", r"exactly one of \1", message)
    return re.sub(r"a valid dictionary or instance of \w+", "a table", message.replace("a valid tuple", "a list"))


def _show(value: Any) -> str:
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_show, value)) + "]"
    if isinstance(value, dict):
        value = {key: v for key, v in value.items() if v is not None}
        return "{ " + ", ".join(f"{key} = {_show(v)}" for key, v in value.items()) + " }"
    return repr(value) if isinstance(value, str) else str(value).lower() if isinstance(value, bool) else str(value)


def _place(path: KeyPath, table: Table, places: dict[KeyPath, str]) -> str:
    for n in range(len(path), 0, -1):
        if path[:n] in places:
            return place_of(places[path[:n]])
    return key_text(path, table)


def key_text(path: KeyPath, table: Table) -> str:
    """Returns a path as a dotted key for `--set`; rows with an `id` appear by it."""
    here: Any = table
    steps = []
    for step in path:
        here = (
            here[step]
            if isinstance(here, list) and isinstance(step, int) and step < len(here)
            else (here.get(step) if isinstance(here, dict) else None)
        )
        named = isinstance(step, int) and isinstance(here, dict) and isinstance(here.get("id"), str)
        steps.append(here["id"] if named else str(step))
    return ".".join(steps)


def known_keys(path: KeyPath, table: Table, form: type[BaseModel] = Scenario) -> list[str]:
    """Returns the keys that a model knows at a path of a table."""
    model: type[BaseModel] | None = form
    here: Any = table
    for step in path:
        here = here[step]
        if isinstance(step, int) or model is None:
            continue
        field = next((f for n, f in model.model_fields.items() if step in (n, f.alias)), None)
        models = [] if field is None else list(dict.fromkeys(_models(field.annotation)))
        model = models[0] if len(models) == 1 else None
        if len(models) > 1:  # only the kinds of orders
            return _event_keys(models, path, table)
    return [] if model is None else [f.alias or n for n, f in model.model_fields.items()]


def _event_keys(models: list[type[BaseModel]], path: KeyPath, table: Table) -> list[str]:
    row = table["event"][path[1]]
    kind = next((m for m in models if row.get("type") in typing.get_args(m.model_fields["type"].annotation)), models[0])
    keys = kind
    for step in path[2:]:
        field = keys.model_fields.get(step) if isinstance(step, str) else None
        inner = [keys] if isinstance(step, int) else [] if field is None else _models(field.annotation)
        if not inner:
            return []
        keys = inner[0]
    return list(keys.model_fields)


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for inner in typing.get_args(annotation) for model in _models(inner)]
