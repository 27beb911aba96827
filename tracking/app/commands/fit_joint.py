"""`flockscope fit joint`: learns the event classifier of `joint` from simulated truth."""

from __future__ import annotations

from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.commands.fitted_scores import fit_and_check_seeds, score_lines
from tracking.app.fit_options import FitJointOptions


def fit_joint(options: FitJointOptions) -> CommandResult:
    """Writes the fitted weights as a TOML file, with the command and the scores as comments; the remaining parameters
    have their defaults.

    The result's data: "file", "params" (the fitted parameters by name), "fitted" and, with --check, "checked", each a
    dictionary of scores (tracking.fitting.joint_events).

    Raises InputError if --out is no .toml file or cannot be written, if a name or seeds are wrong, or if the scenes
    have too few merges or splits. Raises WorkError if a script cannot be fulfilled or the disk is full.
    """
    from scenarios.loading.resolve import resolve
    from sim.io.files.atomic import write_file
    from tracking.fitting.grouping_scenes import simulated
    from tracking.fitting.joint_events import EventRows, event_rows, event_scores, fit_events
    from tracking.papers.joint.config import JointConfig

    out = option_parsing.output_file(options.out, ".toml")
    seeds = fit_and_check_seeds(options.seeds, options.check)
    entries, lag = [entry for name in options.names for entry in resolve(name)], JointConfig().lag
    rows = {
        key: EventRows.joined(event_rows(simulated(e, seed), lag, seed) for e in entries for seed in numbers)
        for key, numbers in seeds.items()
    }
    params = fit_events(rows["fitted"])
    scores = {key: event_scores(part, params) for key, part in rows.items()}
    words = " ".join(["flockscope fit joint", *options.names, f"--seeds {options.seeds}"])
    lines = score_lines(seeds, scores)
    body = [f"{name} = {value}" for name, value in params.items()]
    text = "\n".join([*(f"# {line}" for line in (words, *lines)), 'tracker = "joint"', "", "[params]", *body, ""])
    write_file(out, text.encode())
    result = "\n".join([*lines, "", *body, "", f"→ {out}: use it as --params {out}"])
    return CommandResult({"file": out, "params": params, **scores}, result)
