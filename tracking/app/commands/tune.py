"""The command `flockscope tune`: its options follow from tracking.tuning.options, and it prints what was gained."""

from __future__ import annotations

from dataclasses import MISSING, Field, field, fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from tracking.app import option_parsing
from tracking.app.command_options import Cluster, Detector, Set, StepTimeout, Workers
from tracking.app.command_result import CommandResult
from tracking.app.options_from_dataclass import options_from
from tracking.app.progress import ProgressMeter
from tracking.tuning.options import TuneOptions

# Options that other commands have, too.
SHARED = {"set": Set, "workers": Workers, "cluster": Cluster, "step_timeout": StepTimeout}
# Types on the command line that do not follow from the default.
TYPES = {
    "tracker": str,
    "suite": list[str],
    "out": Path,
    "detections": Literal["image", "truth", "file"] | None,
    "similarity": Literal["boxes", "ground", "image"] | None,
}
REQUIRED = ("out", "trials")  # Options that `tracking.tune` has defaults for and the command has not.
COMMA_SEPARATED = ("only",)
SEEDS = ("seeds", "validation", "test")
NO_CHECK = "none"


def _command_field(option: Field[Any]) -> tuple[str, Any, Any]:
    default = MISSING if option.name in REQUIRED else option.default
    text = default is None or default == "" or option.name in COMMA_SEPARATED
    several = isinstance(default, tuple) and not text
    if option.name in SHARED:
        annotation = SHARED[option.name]
    else:
        kind: Any = str | None if text else list[str] if several else type(option.default)
        parameter: Any = typer.Argument if option.name == "tracker" else typer.Option
        flag = () if option.name == "tracker" else (f"--{option.name}",)
        shown = parameter(*flag, metavar=option.metadata["metavar"], help=option.metadata["help"])
        annotation = Annotated[TYPES.get(option.name, kind), shown]
    if default is MISSING:
        return option.name, annotation, field()
    return option.name, annotation, field(default_factory=list) if several else field(default=None if text else default)


def _command_fields() -> list[tuple[str, Any, Any]]:
    """Returns (name, annotation, dataclass field) of each option of the command line, for `make_dataclass`."""
    found = [_command_field(option) for option in fields(TuneOptions) if option.name != "progress"]
    after = [name for name, *_ in found].index("set") + 1
    return [*found[:after], ("sensor", Detector, field(default=None)), *found[after:]]


CommandLine: Any = make_dataclass("CommandLine", _command_fields(), frozen=True, kw_only=True)


@options_from(CommandLine)
def tune(options: Any) -> CommandResult:
    """Search a tracker's parameters on simulated scenes; measure the gain on others."""
    from tracking.tuning import tune as search

    given = {f.name: getattr(options, f.name) for f in fields(options)}
    sensor = option_parsing.sensor_settings(given.pop("sensor"))
    settings = option_parsing.settings(options.set, "tracker", option_parsing.SUBJECTS)
    given["set"] = [*sensor, *(f"{subject}.{text}" for subject, text in settings)]
    given["check"] = {None: "", NO_CHECK: None}.get(options.check, options.check)
    for name in COMMA_SEPARATED:
        given[name] = tuple(word.strip() for word in (given[name] or "").split(",") if word.strip())
    for name in SEEDS:
        given[name] = None if given[name] is None else option_parsing.seeds(given[name], f"--{name}")
    with ProgressMeter("tune", options.trials) as meter:
        result = search(**given, progress=meter.update)
    params = type(result.config).params()
    changed = [
        f"{name}: {_short(old)} → {_short(new)} {params[name].unit}".rstrip()
        for name, (old, new) in result.changed.items()
    ]
    text = "\n".join([*result.lines(), *changed, f"{options.out}, all figures and plots beside it"])
    return CommandResult({**result.as_dict(), "file": options.out}, text)


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
