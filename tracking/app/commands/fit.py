"""`flockscope fit`: the errors of a detector, from recordings; the belief of who belongs together, from simulations."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np

from scenarios.errors import printable
from sim.io.files.own_files import output_file
from tracking.app import option_parsing
from tracking.app.command_options import FitGroupingOptions, FitSensorOptions
from tracking.app.command_result import CommandResult

# Seeds of the simulated detections whose statistics are shown beside the measured ones.
CHECK_SEEDS = range(30_000, 30_008)


def fit_sensor(options: FitSensorOptions) -> CommandResult:
    """Writes the profile of the detector behind the recordings, pooled over all of them, as a TOML file."""
    from scenarios.loading.resolve import dump_sensor
    from sim.io.files.atomic import write_file
    from sim.io.source import open_source
    from tracking.fitting.detection_matching import match_sequence
    from tracking.fitting.error_statistics import error_statistics, simulated_detections
    from tracking.fitting.sensor import fit_matched
    from tracking.stats import mean_of_finite

    out = output_file(options.out, ".toml")
    opened = [open_source(source, fps=options.fps, images=False) for source in options.sources]
    recordings = [recording for found in opened for recording in found]
    matched = [match_sequence(recording) for recording in recordings]
    profile = fit_matched(matched)
    measured = error_statistics(matched)
    per_seed = [error_statistics([simulated_detections(m, profile, seed) for m in matched]) for seed in CHECK_SEEDS]
    simulated = {name: mean_of_finite(np.array([drawn[name] for drawn in per_seed])) for name in measured}
    people = sum(len(m.match) for m in matched)
    names = ", ".join(printable(recording.name) for recording in recordings)
    write_file(out, dump_sensor(profile, f"flockscope fit sensor: {people} labelled people in {names}").encode())
    lines = [f"{people} labelled people, {sum(len(m.box) for m in matched)} detections in {names}", ""]
    width = max(map(len, measured))
    lines += [f"{'':<{width}}  measured  simulated"]
    lines += [f"{name:<{width}}  {measured[name]:8.3f}  {simulated[name]:9.3f}" for name in measured]
    lines += ["", _use("--sensor", out)]
    data = {"file": out, "sensor": profile.model_dump(exclude_none=True), "measured": measured, "drawn": simulated}
    return CommandResult(data, "\n".join(lines))


def fit_grouping(options: FitGroupingOptions) -> CommandResult:
    """Writes the belief fitted to simulated scenes as a TOML file, with the command and its scores as comments."""
    from sim.io.files.atomic import write_file
    from tracking.fitting.belief import belief_scores, fit_belief, sample_of
    from tracking.fitting.grouping_scenes import pair_scenes

    out, seeds = output_file(options.out, ".toml"), option_parsing.seeds(options.seeds)
    sample = sample_of(list(pair_scenes(options.names, seeds)))
    changes = sample_of(list(pair_scenes(options.events, seeds))) if options.events else None
    belief = fit_belief(sample, changes)
    scores = belief_scores(sample, belief.log_odds(sample.values)[:, 0])
    events = [word for name in options.events for word in ("--events", name)]
    command = shlex.join(["flockscope", "fit", "grouping", *options.names, "--seeds", options.seeds, *events])
    fitted = f"fitted, seeds {options.seeds}: " + ", ".join(f"{name} {value:.4g}" for name, value in scores.items())
    write_file(out, belief.toml_text(f"{command}\n{fitted}").encode())
    return CommandResult({"file": out, "fitted": scores}, f"{fitted}\n{_use('--grouping', out)}")


def _use(option: str, out: Path) -> str:
    return f"→ {out}: use it as {shlex.join([option, str(out)])}"
