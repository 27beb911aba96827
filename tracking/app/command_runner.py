"""Carrying out a command line: whatever happens, the right exit code and one clear line (or one JSON object)."""

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
from tracking.app.command_result import DEBUG, INTERRUPTED, CommandResult, interrupted, refuse, show, unexpected

HELP = {"-h", "--help", "--version"}


def carry_out(app: typer.Typer, arguments: list[str]) -> int:
    """Run the command that the arguments name and print what it says; its exit code."""
    as_json = "--json" in arguments
    if as_json and not HELP.isdisjoint(arguments):  # which some levels of the command line take without --json alone
        arguments = [argument for argument in arguments if argument != "--json"]
    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        try:
            warnings.showwarning = _once()
            answer = _spoken(app, arguments) if as_json else _answer(app, arguments)
            return _said(answer, as_json) if isinstance(answer, CommandResult) else answer
        except KeyboardInterrupt:
            return interrupted(as_json)
        except FlockscopeError as error:
            if error.__cause__ is not None and os.environ.get(DEBUG):
                raise
            return refuse(error, as_json)


def _spoken(app: typer.Typer, arguments: list[str]) -> CommandResult | int:
    """The command's answer, stdout kept free for its one object: help becomes its text, all else goes to stderr."""
    printed = io.StringIO()
    try:
        with redirect_stdout(printed):
            answer = _answer(app, arguments)
        if answer == 0:
            text, printed = printed.getvalue().rstrip("\n"), io.StringIO()
            return CommandResult({"text": text}, text)
        return answer
    finally:
        print(printed.getvalue(), end="", file=sys.stderr)


def _answer(app: typer.Typer, arguments: list[str]) -> CommandResult | int:
    """What the command has to say, or the code of one that has said it (--help)."""
    command: Any = typer.main.get_command(app)
    usage: Any = typer.BadParameter.__base__  # the class of all usage errors, typer's own or click's
    try:
        result = command.main(arguments, prog_name="flockscope", standalone_mode=False)
    except FlockscopeError:
        raise
    except usage as error:
        raise _usage(error) from None
    except Exception as error:
        if _is_of_interruption(error):
            raise KeyboardInterrupt from None
        raise unexpected(error) from error
    if result == INTERRUPTED:  # typer's word for Ctrl-C
        raise KeyboardInterrupt
    return result if isinstance(result, CommandResult) else int(result or 0)


def _is_of_interruption(error: BaseException | None) -> bool:
    """Whether Ctrl-C is what an error came from: an import that it ends may end in another error."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _usage(error: Any) -> InputError:
    """A wrong command line."""
    where = "flockscope" if error.ctx is None else error.ctx.command_path
    message = error.format_message().rstrip(".")
    got, remedy = message[:1].lower() + message[1:], f"see {where} --help"
    return InputError(place=where, got=got, expected="a command line as in the help", remedy=remedy)


def _said(answer: CommandResult, as_json: bool) -> int:
    """Print the answer; a reader who has gone away has read enough, a full disk is told on stderr."""
    try:
        return show(answer, as_json)
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # else Python tries the rest again at its end
        if error.errno == errno.EPIPE:
            return answer.code
        reason = error.strerror or type(error).__name__
        remedy = "free some, or send it elsewhere; files are written"
        return refuse(WorkError(file="stdout", got=reason, expected="room to write", remedy=remedy), as_json=False)


def _once() -> Callable[..., None]:
    """How a command shows warnings: each text once, however many recordings it is true of."""
    said: set[str] = set()

    def warn(message: Warning | str, *_: object) -> None:
        if str(message) not in said:
            print(f"warning: {message}", file=sys.stderr)
        said.add(str(message))

    return warn
