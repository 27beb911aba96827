"""A command whose options are the fields of a dataclass: each option is written once, with type, default and help.

    @dataclass(frozen=True, kw_only=True)
    class FitOptions:
        sources: Annotated[list[Path], typer.Argument(metavar="SOURCE…", help="Labelled recordings.")]
        settings: Annotated[list[str], typer.Option("--set", metavar="K=V")] = field(default_factory=list)

    @app.command()
    @options_from(FitOptions)
    def fit(options: FitOptions) -> CommandResult:
        \"""Help text of the command.\"""

Typer reads a command's options from the signature of its function. The decorator gives the function the signature that
Typer would read if every field were a keyword argument.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

from tracking.app.command_options import Json
from tracking.app.command_result import CommandResult

T = TypeVar("T")


def options_from(options: type[T]) -> Callable[[Callable[[T], CommandResult]], Callable[..., CommandResult]]:
    """Returns a decorator for a command function that takes one instance of the dataclass `options`."""
    parameters = _parameters(options)

    def decorate(command: Callable[[T], CommandResult]) -> Callable[..., CommandResult]:
        def with_keywords(**values: Any) -> CommandResult:
            del values["json"]
            return command(options(**values))

        made: Any = with_keywords
        for name in ("__name__", "__qualname__", "__module__", "__doc__"):
            setattr(made, name, getattr(command, name))
        made.__signature__ = inspect.Signature(parameters)
        made.__annotations__ = {p.name: p.annotation for p in parameters}
        return with_keywords

    return decorate


def _parameters(options: type) -> list[inspect.Parameter]:
    types = get_type_hints(options, include_extras=True)
    found = [_parameter(f.name, types[f.name], _default(f)) for f in dataclasses.fields(options)]
    return [*found, _parameter("json", Json, False)]


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _default(field: dataclasses.Field[Any]) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default
