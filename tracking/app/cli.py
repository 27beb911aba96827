"""The command `flockscope`, made of the options in `command_options`. Modules of `commands/` do the work."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from tracking.app import fit_options
from tracking.app.command_line import add_command, run_command
from tracking.app.command_options import COMMANDS
from tracking.app.command_result import INTERRUPTED
from tracking.app.watched_process import user_trackers, watched

GROUPS = {
    "export": "Convert a dataset, or tracks, to another format.",
    "fit": fit_options.ABOUT,
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
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    arguments = sys.argv[1:]
    trackers = user_trackers(arguments)
    ended = watched(trackers, "--json" in arguments) if trackers else None
    code = run(arguments)
    if ended is not None:
        ended()
    if code == INTERRUPTED:
        sys.stdout.flush()
        os._exit(code)  # sys.exit would end by SIGINT, not with 130, where Ctrl-C came inside an exec of a library
    sys.exit(code)


if __name__ == "__main__":
    main()
