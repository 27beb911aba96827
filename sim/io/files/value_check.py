"""Rules for the values of our JSON files: a reader never meets a value of another kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import is_number


@dataclass(frozen=True)
class Rule:
    """What a value must be."""

    accepts: Callable[[Any], bool]  # returns True for a right value, whatever the type
    words: str  # for the error


Rules = Mapping[str, Rule]  # rules by key

TEXT = Rule(lambda v: isinstance(v, str), "a text")
TABLE = Rule(lambda v: isinstance(v, dict), "an object")
FLAG = Rule(lambda v: isinstance(v, bool), "true or false")


def whole(low: int, high: int) -> Rule:
    """Returns the rule for whole numbers from `low` to `high`, both included."""
    return Rule(
        lambda v: isinstance(v, int) and not isinstance(v, bool) and low <= v <= high,
        f"a whole number from {low} to {high}",
    )


def number(low: float, high: float) -> Rule:
    """Returns the rule for numbers from `low` to `high`, both included."""
    return Rule(lambda v: is_number(v, low, high), f"a number from {low:g} to {high:g}")


def one_of(*words: str) -> Rule:
    """Returns the rule for one of these texts."""
    return Rule(lambda v: v in words, f"one of {', '.join(words)}")


def list_of(rule: Rule) -> Rule:
    """Returns the rule for lists, possibly empty, whose values all follow `rule`."""
    return Rule(lambda v: isinstance(v, list) and all(map(rule.accepts, v)), f"a list, each {rule.words}")


def or_none(rule: Rule) -> Rule:
    """Returns the rule for null, and for values that follow `rule`."""
    return Rule(lambda v: v is None or rule.accepts(v), f"null, or {rule.words}")


def check_values(path: Path, values: Any, rules: Rules, remedy: str, *, inside: str = "") -> None:
    """Raises InputError, with the key, for the first value that does not follow its rule."""
    if not isinstance(values, dict):
        raise InputError(file=path, place=inside, got=repr(values), expected=TABLE.words, remedy=remedy)
    for key, rule in rules.items():
        if (inside or key in values) and not rule.accepts(values.get(key)):
            got = repr(values[key]) if key in values else "nothing"
            place = f"{inside}.{key}" if inside else key
            raise InputError(file=path, place=place, got=got, expected=rule.words, remedy=remedy)
