"""From the words of a command line to an exit code: commands made of options dataclasses, their results and errors.

Of an option given twice click takes the last; a `StrictCommand` refuses it. Every exception becomes an exit code and
one clear line.
"""

from __future__ import annotations

import errno
import inspect
import math
import os
import re
import sys
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext, redirect_stdout
from dataclasses import fields
from importlib import import_module
from typing import Annotated, Any, get_args, get_type_hints

import typer
from typer.core import TyperCommand

from scenarios.errors import FlockscopeError, InputError, WorkError, printable, shortened
from tracking.app import command_result
from tracking.app.command_result import INTERRUPTED, CommandResult, print_error, print_interrupted
from tracking.app.installed_versions import check_installed
from tracking.app.option_parsing import check_output_folder
from tracking.keyword_options import signature_parameter
from tracking.user_code import recorded_interrupts

HELP = {"-h", "--help", "--version"}
# A folder's labels and detections are read alike: one warning is enough for both.
SAME_TABLES = re.compile(r"(gt/gt|det/det)\.txt|\d+ rows")
LONGEST_WARNING = 400  # Characters of a warning that are shown at most.
JSON = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]


def add_command(app: typer.Typer, name: str, options: type, target: str) -> None:
    """Adds the command `name` to the app. It calls the function `target` with an instance of the dataclass `options`.

    Each field of the dataclass is an option of the command, and its docstring is the command's help. target:
    "module:function" in `commands/`.
    """

    def command(**values: Any) -> CommandResult:
        del values["json"]
        check_installed()
        module, _, function = target.partition(":")
        result: CommandResult = getattr(import_module(f"{__package__}.commands.{module}"), function)(options(**values))
        return result

    types, keyword = get_type_hints(options), inspect.Parameter.KEYWORD_ONLY
    own_first = sorted(fields(options), key=lambda f: f.name not in inspect.get_annotations(options))
    annotated = [(f, types[f.name]) for f in own_first]
    parameters = [signature_parameter(f, keyword, Annotated[kind, _declared(f, kind)]) for f, kind in annotated]
    parameters.append(inspect.Parameter("json", keyword, default=False, annotation=JSON))
    made: Any = command
    made.__signature__, made.__doc__ = inspect.Signature(parameters), options.__doc__
    made.__annotations__ = {p.name: p.annotation for p in parameters}
    app.command(name, cls=StrictCommand)(made)


def _declared(f: Any, kind: Any) -> Any:
    m, kinds = f.metadata, (kind, *get_args(kind))
    number = "N" if int in kinds else "X" if float in kinds else None
    flag = f"--{f.name.replace('_', '-')}" if m["flag"] is None else m["flag"]
    more = {"metavar": m["metavar"] or number, "help": m["help"], "min": m["low"], "max": m["high"]}
    return typer.Option(flag, **more) if flag else typer.Argument(**more)


class StrictCommand(TyperCommand):
    """A command that raises InputError if an option has an empty value, or is given twice and takes one value only, or
    if a number is not finite, or --out DIR is no folder."""

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
            # A variable of a shell that is not set gives "".
            if "" in (text if isinstance(text, list | tuple) else [text]):
                name = param.opts[0] if param.param_type_name == "option" else param.name.upper()
                raise InputError(place=name, got="''", expected="a value", remedy="give one, or leave it out")
            value = ctx.params[param.name]
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(place=param.opts[0], got=text, expected="a finite number", remedy="correct it")
            if param.name == "out" and param.metavar == "DIR":
                check_output_folder(ctx.params["out"])
        return rest


def run_command(app: typer.Typer, arguments: list[str]) -> int:
    """Runs the command that the arguments name, prints its result or error, and returns its exit code."""
    as_json = "--json" in arguments and HELP.isdisjoint(arguments)
    if not HELP.isdisjoint(arguments):  # some levels of the command line know --help but not --json
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
        with redirect_stdout(sys.stderr) if as_json else nullcontext():  # what trackers print is no part of the answer
            result = _run(app, arguments)
        return _print(result, as_json) if isinstance(result, CommandResult) else result
    except FlockscopeError as error:
        if error.__cause__ is not None and os.environ.get(command_result.DEBUG):
            raise
        return print_error(error, as_json)


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
        raise command_result.as_flockscope_error(error) from error
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
    if type(error).__name__ == "MissingParameter" and error.param.help:
        expected = f"{error.param.metavar or error.param.name.upper()}: {error.param.help.rstrip('.')}"
    return InputError(place=where, got=got, expected=expected, remedy=remedy)


def _print(result: CommandResult, as_json: bool) -> int:
    try:
        return command_result.print_result(result, as_json)
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
        key = SAME_TABLES.sub("", text) if "rows of class" in text else text
        if key not in printed:
            print(f"warning: {text}", file=sys.stderr)
        printed.add(key)

    return warn
