"""How a command answers: one object on stdout with --json, else text; errors as one line; exit codes.

0 done; 1 the work failed or a check said no; 2 wrong input or usage; 130 interrupted.
"""

from __future__ import annotations

import errno
import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError

STATUS = {0: "ok", 1: "failed", 2: "refused", 130: "interrupted"}
INTERRUPTED = 130
DEBUG = "FLOCKSCOPE_DEBUG"
WIDE = 160
"""Columns of a table that goes to a file or another program."""


@dataclass(frozen=True)
class CommandResult:
    """What a command has to say: data for --json, text (or what rich can print) for people.

    code: 0, or 1 where a check said no.
    """

    data: dict[str, Any]
    text: Any = ""
    code: int = 0


def show(answer: CommandResult, as_json: bool) -> int:
    """Print an answer; its exit code."""
    if as_json:
        _print_json({"status": STATUS[answer.code], **answer.data})
    else:
        text = answer.text if isinstance(answer.text, str) else _laid_out(answer.text)
        print(text.rstrip("\n"), flush=True)
    return answer.code


def _laid_out(tables: Any) -> str:
    """What rich makes of tables, in colour where somebody looks."""
    from rich.console import Console

    console = Console(width=None if sys.stdout and sys.stdout.isatty() else WIDE, highlight=False)
    with console.capture() as captured:
        console.print(tables)
    return captured.get()


def refuse(error: FlockscopeError, as_json: bool) -> int:
    """Print an error as one line or one object; its exit code."""
    if as_json:
        _print_json({"status": STATUS[error.exit_code], "error": error.as_dict()})
    else:
        print(f"error: {error.line()}", file=sys.stderr)
    return error.exit_code


def interrupted(as_json: bool) -> int:
    """Say that Ctrl-C ended the command; 130."""
    remedy = "run the same command again: what was complete is kept"
    error = WorkError(got="an interruption", expected="to finish", remedy=remedy)
    if as_json:
        _print_json({"status": STATUS[INTERRUPTED], "error": error.as_dict()})
    else:
        print(f"interrupted: {remedy}", file=sys.stderr)
    return INTERRUPTED


def unexpected(error: Exception) -> FlockscopeError:
    """An exception nobody foresaw, as an error for the user's eyes."""
    if isinstance(error, OSError):
        return _of_system(error)
    return WorkError(
        got=f"{type(error).__name__}: {error}", expected="no such thing", remedy=f"a bug: {DEBUG}=1 shows where"
    )


def _of_system(error: OSError) -> FlockscopeError:
    """What the operating system refused: the work where the disk is full, else the user's path."""
    from sim.io.files.atomic import DISK_FULL

    reason = error.strerror or type(error).__name__
    file = "" if error.filename is None else error.filename
    if error.errno in DISK_FULL or error.errno in (errno.EIO, errno.ENOMEM):
        return WorkError(file=file, got=reason, expected="room on the disk", remedy="free some, then run it again")
    return InputError(file=file, got=reason, expected="a path that can be used", remedy="check path and rights")


def _print_json(data: dict[str, Any]) -> None:
    print(json.dumps(plain(data), ensure_ascii=False, allow_nan=False), flush=True)


def plain(value: Any) -> Any:
    """What JSON can hold: numpy numbers and arrays as Python's, paths as text, NaN and infinity as null."""
    if isinstance(value, dict):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(v) for v in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
