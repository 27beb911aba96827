"""Runs a command line: prints the command's result, and turns every exception into an exit code and one clear line."""

from __future__ import annotations

import errno
import io
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import Any

import typer

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.printable import printable, shortened
from tracking.app.command_result import (
    DEBUG,
    INTERRUPTED,
    CommandResult,
    as_flockscope_error,
    print_error,
    print_interrupted,
    print_result,
)
from tracking.running.interrupts import recorded_interrupts

HELP = {"-h", "--help", "--version"}
LONGEST_WARNING = 400  # Characters of a warning that are shown at most.


def run_command(app: typer.Typer, arguments: list[str]) -> int:
    """Runs the command that the arguments name, prints its result or error, and returns its exit code."""
    as_json = "--json" in arguments
    if as_json and not HELP.isdisjoint(arguments):  # some levels of the command line know --help but not --json
        arguments = [argument for argument in arguments if argument != "--json"]
    code = None
    try:
        with warnings.catch_warnings(), recorded_interrupts():
            warnings.simplefilter("always", UserWarning)
            warnings.showwarning = _print_warnings_once()
            code = _run_and_print(app, arguments, as_json)
    except KeyboardInterrupt:
        return print_interrupted(as_json) if code is None else code
    return code


def _run_and_print(app: typer.Typer, arguments: list[str], as_json: bool) -> int:
    try:
        result = _run_quietly(app, arguments) if as_json else _run(app, arguments)
        return _print(result, as_json) if isinstance(result, CommandResult) else result
    except FlockscopeError as error:
        if error.__cause__ is not None and os.environ.get(DEBUG):
            raise
        return print_error(error, as_json)


def _run_quietly(app: typer.Typer, arguments: list[str]) -> CommandResult | int:
    printed = io.StringIO()
    try:
        with redirect_stdout(printed):
            result = _run(app, arguments)
        if result == 0:
            text, printed = printed.getvalue().rstrip("\n"), io.StringIO()
            return CommandResult({"text": text}, text)
        return result
    finally:
        print(printed.getvalue(), end="", file=sys.stderr)


def _run(app: typer.Typer, arguments: list[str]) -> CommandResult | int:
    command: Any = typer.main.get_command(app)
    usage_error: Any = typer.BadParameter.__base__  # the class of all usage errors, typer's own or click's
    try:
        result = command.main(arguments, prog_name="flockscope", standalone_mode=False)
    except FlockscopeError:
        raise
    except usage_error as error:
        raise _usage(error) from None
    except (Exception, SystemExit, GeneratorExit) as error:
        if _comes_from_interrupt(error):
            raise KeyboardInterrupt from None
        raise as_flockscope_error(error) from error
    if result == INTERRUPTED:  # what typer returns for Ctrl-C
        raise KeyboardInterrupt
    return result if isinstance(result, CommandResult) else int(result or 0)


def _comes_from_interrupt(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _usage(error: Any) -> InputError:
    where = "flockscope" if error.ctx is None else error.ctx.command_path
    message = error.format_message().rstrip(".").removeprefix("Got ")
    got, expected, remedy = message[:1].lower() + message[1:], "a command line as in the help", f"see {where} --help"
    if type(error).__name__ == "MissingParameter" and error.param is not None:
        value = error.param.metavar or error.param.name.upper()
        expected = f"{error.param.opts[0]} {value}" if error.param.param_type_name == "option" else value
        expected += f": {error.param.help.rstrip('.')}" if error.param.help else ""
        remedy = f"add it; {remedy}"
    return InputError(place=where, got=got, expected=expected, remedy=remedy)


def _print(result: CommandResult, as_json: bool) -> int:
    try:
        return print_result(result, as_json)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # else Python tries to write the rest when it exits
        if error.errno == errno.EPIPE:
            return result.code
        reason = error.strerror or type(error).__name__
        remedy = "free some, or send it elsewhere; files are written"
        return print_error(WorkError(file="stdout", got=reason, expected="room to write", remedy=remedy), as_json=False)


def _print_warnings_once() -> Callable[..., None]:
    printed: set[str] = set()

    def warn(message: Warning | str, *_: object) -> None:
        text = shortened(printable(" ".join(str(message).split())), LONGEST_WARNING)
        if text not in printed:
            print(f"warning: {text}", file=sys.stderr)
        printed.add(text)

    return warn
