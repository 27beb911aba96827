"""`flockscope fit joint`: learns the event classifier or the Dirichlet process mixture of `joint` from simulated
truth."""

from __future__ import annotations

from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.commands.fitted_scores import fit_and_check_seeds, score_lines
from tracking.app.fit_options import FitJointOptions

Scores = dict[str, dict[str, float]]


def fit_joint(options: FitJointOptions) -> CommandResult:
    """Writes the fitted parameters as a TOML file, with the command and the scores as comments."""
    from sim.io.files.atomic import write_file

    out = option_parsing.output_file(options.out, ".toml")
    seeds = fit_and_check_seeds(options.seeds, options.check)
    params, scores = {"events": _events, "components": _components}[options.learn](options, seeds)
    own = [] if options.learn == "events" else [f"--learn {options.learn}"]
    words = " ".join(["flockscope fit joint", *options.names, *own, f"--seeds {options.seeds}"])
    lines = score_lines(seeds, scores)
    body = [f"{name} = {value}" for name, value in params.items()]
    text = "\n".join([*(f"# {line}" for line in (words, *lines)), 'tracker = "joint"', "", "[params]", *body, ""])
    write_file(out, text.encode())
    shown = [f"{name:<22}  {value:9.4f}" for name, value in params.items()]
    result = "\n".join([*lines, "", *shown, "", f"→ {out}: use it as --params {out}"])
    return CommandResult({"file": out, "params": params, **scores}, result)


def _events(options: FitJointOptions, seeds: dict[str, range]) -> tuple[dict[str, float], Scores]:
    """Returns the weights of the event classifier, and the scores on the seeds fitted to and checked."""
    from scenarios.loading.resolve import resolve
    from tracking.fitting.grouping_scenes import simulated
    from tracking.fitting.joint_events import EventRows, event_rows, event_scores, fit_events
    from tracking.papers.joint.config import JointConfig

    entries, lag = [entry for name in options.names for entry in resolve(name)], JointConfig().lag
    rows = {
        key: EventRows.joined(event_rows(simulated(e, seed), lag, seed) for e in entries for seed in numbers)
        for key, numbers in seeds.items()
    }
    weights = fit_events(rows["fitted"])
    return weights, {key: event_scores(part, weights) for key, part in rows.items()}


def _components(options: FitJointOptions, seeds: dict[str, range]) -> tuple[dict[str, float], Scores]:
    """Returns the parameters of the Dirichlet process mixture, and the scores on the seeds fitted to and checked."""
    from scenarios.loading.resolve import resolve
    from tracking.fitting.grouping_scenes import simulated
    from tracking.fitting.joint_components import component_scores, fit_components, true_partitions

    entries = [entry for name in options.names for entry in resolve(name)]
    parts = {
        key: [p for e in entries for seed in numbers for p in true_partitions(simulated(e, seed), seed)]
        for key, numbers in seeds.items()
    }
    params = fit_components(parts["fitted"])
    return params, {key: component_scores(part, params) for key, part in parts.items()}
