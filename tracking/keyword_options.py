"""Options of a public function or command, declared once as the fields of a frozen dataclass.

The dataclass holds name, type, default, range and help text of every option. A function takes `**options`, builds the
dataclass of them, and gets the list of options in its docstring from `documented`. A command is made of it by
`tracking.app.command_line`.

    @dataclass(frozen=True, kw_only=True)
    class FitOptions:
        folds: int = option("Number of folds.", 5, low=2)
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, field, fields
from typing import Any, TypeVar

from scenarios.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])


def option(help: str, default: Any = MISSING, **more: Any) -> Any:
    """Declares an option as a field of a dataclass. An option without a default is required.

    Args:
        help: A description of the option.
        default: The value if the option is not given; [] gives each instance a new empty list.
        more: Any of: low and high, the least and greatest allowed value; below, a bound that the value must be less
            than; metavar, the word that stands for the value in the help of a command; flag, the option's name on the
            command line if it differs from the field's name, "" for a positional argument.
    """
    metadata = {"help": help, "low": None, "high": None, "below": None, "metavar": None, "flag": None, **more}
    return (
        field(default_factory=list, metadata=metadata) if default == [] else field(default=default, metadata=metadata)
    )


def check_ranges(options: Any) -> None:
    """Raises InputError for the first option of an options dataclass that is less than `low`, or not less than `below`.
    Options without `low`, and absent ones, are not checked, and `high` is not checked here."""
    for f in fields(options):
        low, below, value = f.metadata["low"], f.metadata["below"], getattr(options, f.name)
        if low is None or (value is None and f.default is None):
            continue
        if value is not None and (value >= low and (below is None or value < below)):
            continue
        expected = f"{low:g} or more" if below is None else f"a number from {low:g} to under {below:g}"
        raise InputError(place=f"--{f.name}", got=value, expected=expected, remedy="correct it")


def documented(kind: type) -> Callable[[F], F]:
    """Returns a decorator that lists the options of a dataclass in the docstring of a function."""

    def decorate(function: F) -> F:
        function.__doc__ = f"{inspect.getdoc(function)}\n\nOptions:\n\n{options_text(kind)}\n"
        return function

    return decorate


def options_text(kind: type) -> str:
    """Returns the options of an options dataclass as text, one line per option: name, default and help."""
    return "\n".join(f"{f.name}{'' if required(f) else f'={f.default!r}'}: {f.metadata['help']}" for f in fields(kind))


def required(f: Field[Any]) -> bool:
    """Returns True if an option has no default."""
    return f.default is MISSING and f.default_factory is MISSING


def signature_parameter(f: Field[Any], kind: Any, annotation: Any) -> inspect.Parameter:
    """Returns an option as a parameter of a signature, of this kind and with this annotation."""
    default = inspect.Parameter.empty if required(f) else [] if f.default is MISSING else f.default
    return inspect.Parameter(f.name, kind, default=default, annotation=annotation)
