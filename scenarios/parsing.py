"""Parses TOML and JSON texts into plain values: every text gives a value or an InputError of one line.

Besides wrong syntax, values are refused that other code could not hold: deep nesting, whole numbers beyond 64 bits, and
in JSON the words NaN and Infinity.
"""

from __future__ import annotations

import json
import tomllib
from typing import Any, NoReturn

from scenarios.errors import InputError
from scenarios.limits import DEPTH, INTEGER, NESTING

FAR = "whole numbers within 64 bits"


def parse_toml(text: str, file: object = "") -> dict[str, Any]:
    """Returns the table that a TOML text stands for."""
    remedy = "correct the line; strings need quotes, tables inside a line need { }"
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message, _, place = str(error).rpartition(" (at ")
        raise InputError(
            file=file, place=place.rstrip(")"), got=message or str(error), expected="TOML", remedy=remedy
        ) from None
    except RecursionError:
        raise _too_deep(file) from None
    except (ValueError, OverflowError) as error:  # of int() and of dates, which tomllib lets through
        raise InputError(file=file, got=_reason(error), expected="TOML", remedy=remedy) from None
    _require_plain(table, file)
    return table


def parse_json(text: str, file: object = "", remedy: str = "correct the file") -> Any:
    """Returns the value that a JSON text stands for."""
    try:
        value = json.loads(text, parse_constant=_constant)
    except json.JSONDecodeError as error:
        raise InputError(
            file=file, place=f"line {error.lineno}", got=f"no JSON ({error.msg})", expected="JSON", remedy=remedy
        ) from None
    except RecursionError:
        raise _too_deep(file) from None
    except ValueError as error:
        raise InputError(file=file, got=_reason(error), expected="JSON", remedy=remedy) from None
    _require_plain(value, file)
    return value


def _constant(word: str) -> NoReturn:
    raise ValueError(f"{word}, which is no number of JSON")


def _reason(error: Exception) -> str:
    text = str(error)
    # Python's advice to raise its limit of digits helps no user.
    return "a number of thousands of digits" if "integer string conversion" in text else text


def _too_deep(file: object) -> InputError:
    return InputError(file=file, got="deeper nesting", expected=NESTING, remedy="check that this is the right file")


def _require_plain(value: Any, file: object) -> None:
    # Without recursion: the nesting may be deeper than Python's stack.
    level = [value]
    for _ in range(DEPTH + 1):
        for item in level:
            if isinstance(item, int) and abs(item) > INTEGER:
                raise InputError(file=file, got=item, expected=FAR, remedy="correct the number")
        level = [inner for item in level for inner in _inside(item)]
        if not level:
            return
    raise _too_deep(file)


def _inside(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []
