"""The command `flockscope`, made of the options in `command_options`. Modules of `commands/` do the work."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from tracking.app.command_line import add_command, run_command
from tracking.app.command_options import COMMANDS
from tracking.app.command_result import INTERRUPTED

GROUPS = {
    "export": "Convert a dataset, or tracks, to another format.",
    "fit": "Fit a model to recordings or simulated scenes.",
}

app = typer.Typer(
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    help="Group tracking under test: simulate labelled crowds, track people and groups, score.",
)


groups = {name: typer.Typer(rich_markup_mode=None, help=text) for name, text in GROUPS.items()}
for name, group in groups.items():
    app.add_typer(group, name=name)
for words, (kind, target) in COMMANDS.items():
    family, _, name = words.rpartition(" ")
    add_command(groups.get(family, app), name, kind, target)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(version("flockscope"))
        raise typer.Exit


@app.callback()
def _start(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Takes the options of the command itself."""


def run(arguments: Sequence[str]) -> int:
    """Runs one command line, prints its result on stdout or its error on stderr, and returns the exit code."""
    return run_command(app, list(arguments) or ["--help"])


def main() -> None:
    """Runs the command line of this process (sys.argv), and ends the process with the command's exit code."""
    _open_streams()
    code = run(sys.argv[1:])
    if code == INTERRUPTED:
        sys.stdout.flush()
        os._exit(code)  # sys.exit would end by SIGINT, not with 130, where Ctrl-C came inside an exec of a library
    sys.exit(code)


def _open_streams() -> None:
    # A file that is opened later would take the number of a closed stream, and get what is printed.
    for number, mode in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # takes the lowest free number, which is this one
    for number, name in ((1, "stdout"), (2, "stderr")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w", encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
