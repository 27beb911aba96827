"""Keyword options of a public function or class, declared once as the fields of a frozen dataclass.

The dataclass holds name, type, default, range and help text of every option. The function takes `**options`, builds the
dataclass with `from_keywords`, and gets its signature and the list of options in its docstring from `documented`.

    @dataclass(frozen=True, kw_only=True)
    class FitOptions:
        folds: int = field(default=5, metadata=option("Number of folds.", low=2))
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields
from typing import Any, TypeVar

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")


def option(
    help: str, *, low: float | None = None, below: float | None = None, metavar: str | None = None
) -> dict[str, Any]:
    """Returns the metadata of a dataclass field for an option, with the keys help, low, below, metavar."""
    return {"help": help, "low": low, "below": below, "metavar": metavar}


def from_keywords(kind: type[T], function: str, given: Mapping[str, Any]) -> T:
    """Returns an instance of the options dataclass `kind` with the given values by name and otherwise its defaults."""
    known = [f for f in fields(kind) if f.init]  # type: ignore[arg-type]
    names = [f.name for f in known]
    for name in given:
        if name not in names:
            expected, remedy = f"one of {', '.join(names)}", f"did you mean {closest(name, names)}?"
            raise InputError(place=f"{function}(…)", got=f"{name}=…", expected=expected, remedy=remedy)
    for f in known:
        if _required(f) and f.name not in given:
            raise InputError(place=f"{function}(…)", got="nothing", expected=f"{f.name}=…", remedy=f"give {f.name}")
    return kind(**given)


def check_ranges(options: Any) -> None:
    """Raises InputError at the first number of an options dataclass that lies outside its declared range."""
    for f in fields(options):
        low, below, value = f.metadata.get("low"), f.metadata.get("below"), getattr(options, f.name)
        if low is None or (value >= low and (below is None or value < below)):
            continue
        expected = f"{low:g} or more" if below is None else f"a number from {low:g} to under {below:g}"
        raise InputError(place=f"--{f.name}", got=value, expected=expected, remedy="correct it")


def documented(kind: type, positional: int = 0) -> Callable[[F], F]:
    """Returns a decorator that gives a function the signature and the list of options of a dataclass.

    The first `positional` options may be given without their name. A first parameter `self` is kept.
    """

    def decorate(function: F) -> F:
        own = list(inspect.signature(function).parameters.values())
        options = [_parameter(f, k < positional) for k, f in enumerate(fields(kind))]
        made: Any = function
        made.__signature__ = inspect.Signature([*(p for p in own if p.name == "self"), *options])
        made.__doc__ = f"{inspect.getdoc(function)}\n\nOptions:\n\n{options_text(kind)}\n"
        return function

    return decorate


def options_text(kind: type) -> str:
    """Returns the options of an options dataclass, one a line."""
    return "\n".join(f"{f.name}{'' if _required(f) else f'={f.default!r}'}: {f.metadata['help']}" for f in fields(kind))


def _required(f: Field[Any]) -> bool:
    return f.default is MISSING and f.default_factory is MISSING


def _parameter(f: Field[Any], positional: bool) -> inspect.Parameter:
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD if positional else inspect.Parameter.KEYWORD_ONLY
    default = inspect.Parameter.empty if _required(f) else f.default
    return inspect.Parameter(f.name, kind, default=default, annotation=f.type)
