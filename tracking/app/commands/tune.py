"""The command `flockscope tune`: its options follow from tracking.tuning.options, and it prints what was gained."""

from __future__ import annotations

from dataclasses import MISSING, fields, make_dataclass
from pathlib import Path
from typing import Any, Literal

from tracking.app import command_options as shared
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.keyword_options import option
from tracking.tuning.options import TuneOptions

# Options that other commands have, too, and types on the command line that do not follow from the default.
SHARED = {
    "set": shared.SET, "workers": shared.WORKERS, "cluster": shared.CLUSTER, "step_timeout": shared.STEP_TIMEOUT
}  # fmt: skip
TYPES = {
    "tracker": str, "suite": list[str], "set": list[str], "out": Path, "step_timeout": float | None,
    "detections": Literal["image", "truth", "file"] | None, "similarity": Literal["boxes", "ground", "image"] | None,
}  # fmt: skip
REQUIRED = ("out", "trials")  # Options that `tracking.tune` has defaults for and the command has not.
COMMA_SEPARATED = ("only",)
SEEDS = ("seeds", "validation", "test")
NO_CHECK = "none"


def _command_fields() -> list[tuple[str, Any, Any]]:
    """Returns (name, type, dataclass field) of each option of the command line, for `make_dataclass`."""
    found: list[tuple[str, Any, Any]] = []
    for f in fields(TuneOptions):
        default = MISSING if f.name in REQUIRED else f.default
        text = default is None or default == "" or f.name in COMMA_SEPARATED
        several = isinstance(default, tuple) and not text
        kind: Any = str | None if text else list[str] if several else type(f.default)
        flag = "" if f.name == "tracker" else f"--{f.name}"
        given = option(
            f.metadata["help"], [] if several else None if text else default, metavar=f.metadata["metavar"], flag=flag
        )
        found.append((f.name, TYPES.get(f.name, kind), SHARED[f.name]() if f.name in SHARED else given))
        if f.name == "set":
            found.append(("sensor", Path | None, shared.SENSOR()))
    return [row for row in found if row[0] != "progress"]


CommandLine: Any = make_dataclass("CommandLine", _command_fields(), frozen=True, kw_only=True)
CommandLine.__doc__ = "Search a tracker's parameters on simulated scenes; measure the gain on others."


def tune(options: Any) -> CommandResult:
    """Searches parameters as `tracking.tune` does, and returns what was gained."""
    from tracking.tuning.result import short
    from tracking.tuning.search import tune as search

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
        f"{name}: {short(old)} → {short(new)} {params[name].unit}".rstrip()
        for name, (old, new) in result.changed.items()
    ]
    text = "\n".join([*result.lines(), *changed, f"{options.out}, all figures and plots beside it"])
    return CommandResult({**result.as_dict(), "file": options.out}, text)
