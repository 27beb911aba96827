"""The result of a command and its output: one JSON object on stdout with --json, else text; errors as one line.

Exit codes: 0 done; 1 the work failed or a check found problems; 2 wrong input or usage; 130 interrupted.
"""

from __future__ import annotations

import errno
import json
import sys
from dataclasses import dataclass
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError, printable

STATUS = {0: "ok", 1: "failed", 2: "refused", 130: "interrupted"}  # The "status" of the JSON object, by exit code.

INTERRUPTED = 130
DEBUG = "FLOCKSCOPE_DEBUG"  # With this environment variable set, an unexpected exception is raised with its traceback.


@dataclass(frozen=True)
class CommandResult:
    """The result of a command: the data for --json, the text to print, and the exit code."""

    data: dict[str, Any]  # content of the JSON object that --json prints, without its "status"
    text: str = ""  # printed without --json
    code: int = 0  # exit code: 0; 1 if a check found problems; 2 if the input does not suffice for it


def print_result(result: CommandResult, as_json: bool) -> int:
    """Prints the result of a command on stdout and returns its exit code."""
    if as_json:
        from sim.store.tables import plain

        _print_json({"status": STATUS[result.code], **plain(result.data)})
    elif result.text:
        print(printable(result.text, keep="\n").rstrip("\n"), flush=True)
    return result.code


def print_error(error: FlockscopeError, as_json: bool) -> int:
    """Prints an error and returns its exit code, 2 for wrong input (InputError), 1 if the work failed."""
    if as_json:
        _print_json({"status": STATUS[error.exit_code], "error": error.as_dict()})
    else:
        print(f"error: {error.line()}", file=sys.stderr)
    return error.exit_code


def print_interrupted(as_json: bool) -> int:
    """Prints that Ctrl-C ended the command and which commands continue when run again; returns the exit code 130."""
    remedy = "run the same command again; generate, replay, stress and tune continue, others begin anew"
    error = WorkError(got="an interruption", expected="to finish", remedy=remedy)
    if as_json:
        _print_json({"status": STATUS[INTERRUPTED], "error": error.as_dict()})
    else:
        print(f"interrupted: {remedy}", file=sys.stderr)
    return INTERRUPTED


def as_flockscope_error(error: BaseException) -> FlockscopeError:
    """Returns (does not raise) the error to show to users for an unexpected exception: InputError or WorkError for a
    fault of the system, such as a full disk, else a WorkError that says that it is a bug."""
    if not isinstance(error, OSError):
        remedy = f"this is a bug: {DEBUG}=1 shows where"
        return WorkError(got=f"{type(error).__name__}: {error}", expected="no exception", remedy=remedy)
    from sim.store.atomic import DISK_FULL

    reason = error.strerror or type(error).__name__
    file = "" if error.filename is None else error.filename
    if error.errno in DISK_FULL or error.errno in (errno.EIO, errno.ENOMEM):
        return WorkError(file=file, got=reason, expected="room on the disk", remedy="free some, then run it again")
    return InputError(file=file, got=reason, expected="a path that can be used", remedy="check path and rights")


def _print_json(data: dict[str, Any]) -> None:
    print(json.dumps(data, allow_nan=False), flush=True)
