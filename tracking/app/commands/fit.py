"""`flockscope fit`: tables learned from recordings. `sensor`: a detector's error profile from its det and gt."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sim.types import Sequence as Recording
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult

SEEDS = range(30_000, 30_008)  # of the draws that are laid beside the real errors
SHOWN = (
    "missed", "misses: mean run, s", "false alarms per frame", "false alarms: at people", "false alarms: mean stay, s",
    "overlap, 10% quantile", "overlap, 50% quantile", "overlap, 90% quantile", "error correlation after 0.2 s",
)  # fmt: skip


def sensor(sources: Sequence[Path], out: Path, fps: float | None) -> CommandResult:
    """The profile of the detector behind these recordings, pooled, as a file with a [sensor] table."""
    from scenarios.loading.sensor_profiles import dump_sensor
    from sim.io.files.atomic import write_file
    from tracking.fitting.matching import match_sequence
    from tracking.fitting.sensor import fit
    from tracking.fitting.statistics import again, statistics

    option_parsing.named(out, ".toml")
    recordings = _open(sources, fps)
    matched = [match_sequence(recording) for recording in recordings]
    found = fit(matched)
    real = statistics(matched)
    drawn = [statistics([again(m, found, seed) for m in matched]) for seed in SEEDS]
    like = {name: _mean([d[name] for d in drawn]) for name in real}
    people = sum(len(m.match) for m in matched)
    names = ", ".join(recording.name for recording in recordings)
    write_file(out, dump_sensor(found, f"A detector's profile, of {people} labelled people in {names}").encode())
    lines = [f"{people} labelled people, {sum(len(m.box) for m in matched)} detections in {names}", ""]
    wide = max(map(len, SHOWN))
    lines += [f"{'':<{wide}}  measured  so drawn"]
    lines += [f"{name:<{wide}}  {real[name]:8.3f}  {like[name]:8.3f}" for name in SHOWN]
    lines += ["", f"→ {out}: give it as --sensor {out}"]
    data = {"file": out, "sensor": found.model_dump(exclude_none=True), "measured": real, "drawn": like}
    return CommandResult(data, "\n".join(lines))


def _open(sources: Sequence[Path], fps: float | None) -> list[Recording]:
    from sim.io.source import open_source

    return [sequence for source in sources for sequence in open_source(source, fps=fps, images=False)]


def _mean(values: list[float]) -> float:
    """Of those that are known."""
    known = [v for v in values if np.isfinite(v)]
    return float(np.mean(known)) if known else float("nan")
