"""Commands that refuse what click accepts in silence: an option given twice, and numbers in other digits than 0 to 9.

Of an option given twice click takes the last. Python reads `1_0` as 10, and the digits of other scripts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, TypeVar

import typer
from typer.core import TyperCommand

from scenarios.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])


class StrictTyper(typer.Typer):
    """A Typer whose commands are `StrictCommand`s."""

    def command(self, name: str | None = None, **settings: Any) -> Callable[[F], F]:
        """Returns Typer's decorator that declares a command."""
        return super().command(name, cls=StrictCommand, **settings)


class StrictCommand(TyperCommand):
    """A command that raises InputError for an option given twice, unless it may be, and for numbers in other digits."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parses the words of the command line after the command's name, as Typer does."""
        given, _, params = self.make_parser(ctx).parse_args(args=list(args))
        for param, times in Counter(params).items():
            if times > 1 and param.param_type_name == "option" and not (param.multiple or param.is_eager):
                name, last = param.opts[0], given[param.name]
                got = f"it {times} times" + (f", the last time {last}" if isinstance(last, str) else "")
                raise InputError(place=name, got=got, expected="it once", remedy=f"leave one {name} only")
        rest = super().parse_args(ctx, args)
        for param in params:
            text = given.get(param.name)
            if isinstance(text, str) and isinstance(ctx.params.get(param.name), int | float):
                _check_number(param.opts[0], text)
        return rest


def _check_number(option: str, text: str) -> None:
    from sim.io.files.numeric_text import is_number_text

    if not is_number_text(text):
        raise InputError(place=option, got=repr(text), expected="a number in digits 0 to 9", remedy="correct it")
