"""The command `flockscope`: the table of commands. The work of each is in the module of `commands/` that it names."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Annotated, Any

import typer

from tracking.app import command_options as options
from tracking.app.command_line import add_command, run_command
from tracking.app.command_result import INTERRUPTED, CommandResult
from tracking.app.commands.tune import CommandLine

# By the words of a command: its options, and the function that takes them, by its module in `commands/`.
COMMANDS: dict[str, tuple[Any, str]] = {
    "demo": (options.DemoOptions, "demo:demo"),
    "scenarios": (options.ScenariosOptions, "scenarios:scenarios"),
    "generate": (options.GenerateOptions, "datasets:generate"),
    "track": (options.TrackOptions, "track:track"),
    "group": (options.GroupOptions, "group:group"),
    "score": (options.ScoreOptions, "score:score"),
    "stress": (options.StressOptions, "stress:stress"),
    "minimize": (options.MinimizeOptions, "minimize:minimize"),
    "errors": (options.ErrorsOptions, "errors:errors"),
    "compare": (options.CompareOptions, "compare:compare"),
    "tune": (CommandLine, "tune:tune"),
    "replay": (options.ReplayCommandOptions, "datasets:replay"),
    "fit sensor": (options.FitSensorOptions, "fit:fit_sensor"),
    "fit grouping": (options.FitGroupingOptions, "fit:fit_grouping"),
    "fit joint": (options.FitJointOptions, "fit:fit_joint"),
    "fit relational": (options.FitRelationalOptions, "fit:fit_relational"),
    "view": (options.ViewOptions, "view:view"),
    "sheet": (options.SheetOptions, "view:sheet"),
    "overlay": (options.OverlayOptions, "view:overlay"),
    "validate": (options.ValidateOptions, "datasets:validate"),
    "export csv": (options.CsvOptions, "tables:export_csv"),
    "export parquet": (options.ParquetOptions, "tables:export_parquet"),
    "export trajnet": (options.TrajnetOptions, "tables:export_trajnet"),
    "export pedpy": (options.PedpyOptions, "tables:export_pedpy"),
    "export coco": (options.CocoOptions, "datasets:export_coco"),
    "export kitti": (options.KittiOptions, "datasets:export_kitti"),
    "export webdataset": (options.WebdatasetOptions, "datasets:export_webdataset"),
}
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


def _declare() -> None:
    groups = {name: typer.Typer(rich_markup_mode=None, help=text) for name, text in GROUPS.items()}
    for name, group in groups.items():
        app.add_typer(group, name=name)
    for words, (kind, target) in COMMANDS.items():
        family, _, name = words.rpartition(" ")
        add_command(groups.get(family, app), name, kind, _called(target))


def _called(target: str) -> Any:
    module, _, function = target.partition(":")

    def run(given: Any) -> CommandResult:
        result: CommandResult = getattr(import_module(f"tracking.app.commands.{module}"), function)(given)
        return result

    return run


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(version("flockscope"))
        except PackageNotFoundError:
            print("unknown: not installed")
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
    """Runs the command line of this process (sys.argv) and never returns."""
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
    if sys.stdout is None:
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


_declare()
if __name__ == "__main__":
    main()
