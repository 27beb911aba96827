"""`flockscope tune`: search a tracker's parameters on simulated scenes, and say what was gained on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sim.types import DetectionMode
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter

NONE = "none"


@dataclass(frozen=True)
class Wishes:
    """The options of the command, as they were written."""

    tracker: str
    suite: Sequence[str]
    trials: int
    out: Path
    seeds: str | None = None
    validation: str | None = None
    test: str | None = None
    check: str | None = None
    objective: Sequence[str] = ()
    detections: DetectionMode | None = None
    settings: Sequence[str] = ()
    only: str | None = None
    sensor: Path | None = None


def tune(wishes: Wishes, **search_options: Any) -> CommandResult:
    """Search, judge, write; what was gained as text and data. search_options: as `tracking.tune` takes them."""
    from tracking.tuning import tune as search

    found = option_parsing.settings(wishes.settings, "tracker", option_parsing.SUBJECTS)
    texts = [*option_parsing.sensor_settings(wishes.sensor), *(f"{subject}.{text}" for subject, text in found)]
    check = {None: "", NONE: None}.get(wishes.check, wishes.check)
    only = tuple(word.strip() for word in (wishes.only or "").split(",") if word.strip())
    with ProgressMeter("tune", wishes.trials) as meter:
        result = search(
            wishes.tracker, wishes.suite, wishes.trials, out=wishes.out, check=check, set=texts, only=only,
            objective=wishes.objective, detections=wishes.detections, progress=meter.update,
            seeds=_seeds("--seeds", wishes.seeds), validation=_seeds("--validation", wishes.validation),
            test=_seeds("--test", wishes.test), **search_options,
        )  # fmt: skip
    params = type(result.config).params()
    changed = [
        f"{name}: {_shown(old)} → {_shown(new)} {params[name].unit}".rstrip()
        for name, (old, new) in result.changed.items()
    ]
    told = "\n".join([*result.lines(), *changed, f"{wishes.out}, all figures and plots beside it"])
    return CommandResult({**result.as_dict(), "file": wishes.out}, told)


def _shown(value: Any) -> str:
    """A value in four figures; the file has all."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _seeds(option: str, text: str | None) -> range | None:
    return None if text is None else option_parsing.seeds(text, option)
