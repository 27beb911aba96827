"""`flockscope fit`: the errors of a detector, from recordings; and from simulated truth the belief of who belongs
together, the events of `joint`, and the speed table of `relational`.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError, printable, reject
from sim.store.own_files import output_file
from sim.types import Sequence as Recording
from sim.types import Truth
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.fit_options import (
    FitGroupingOptions,
    FitJointOptions,
    FitRelationalOptions,
    FitSceneOptions,
    FitSensorOptions,
)
from tracking.app.sequence_workers import source_of

if TYPE_CHECKING:
    from tracking.fitting.scene_like import Likeness

# Seeds of the simulated detections whose statistics are shown beside the measured ones.
CHECK_SEEDS = range(30_000, 30_008)

# Options on how the people of answers are read.
READING = ("fps", "px_per_m", "person_class", "box_scale", "camera")
SIMULATED = "they are for SOURCE with --labels"


def fit_sensor(options: FitSensorOptions) -> CommandResult:
    """Writes the profile of the detector behind the recordings, pooled over all of them, as a TOML file."""
    from scenarios.loading.resolve import dump_sensor
    from sim.store.atomic import write_file
    from tracking.fitting.detection_matching import match_sequence
    from tracking.fitting.error_statistics import error_statistics, simulated_detections
    from tracking.fitting.sensor import fit_matched
    from tracking.recordings.source import open_source
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


def fit_scene(options: FitSceneOptions) -> CommandResult:
    """Writes a scenario like a recording as a TOML file."""
    words = ["fit", "scene", str(options.source), *["--labels"] * options.labels]
    out = output_file(options.out, ".toml")
    found = scene_file(source_of(options, options.source).open(), options.labels, out, words)
    lines = [found.text(), f"→ {out}: use it as a scenario, as in {shlex.join(['flockscope', 'generate', str(out)])}"]
    return CommandResult({"file": out, **found.as_dict()}, "\n".join(lines))


def scene_file(recordings: Sequence[Recording], labels: bool, out: Path, words: Sequence[str]) -> Likeness:
    """Writes a scenario like the one recording, and returns it; words: of the command."""
    from sim.store.atomic import write_file
    from tracking.fitting.scene_like import scene_like

    got = f"{len(recordings)} sequences"
    reject(len(recordings) != 1, recordings[0].name, got, "one, of one camera", "give one of them")
    found = scene_like(recordings[0], labels=labels)
    write_file(out, f"# {shlex.join(['flockscope', *words])}\n{found.to_toml()}".encode())
    return found


def fit_grouping(options: FitGroupingOptions) -> CommandResult:
    """Writes the belief fitted to simulated scenes as a TOML file, with the command and its scores as comments; with
    `labels`, the default belief adapted to the answers."""
    if options.labels:
        return _adapt_grouping(options)
    from sim.store.atomic import write_file
    from tracking.fitting.belief import fit_belief, sample_of, shifts_of_sample
    from tracking.fitting.belief_scores import belief_scores
    from tracking.fitting.grouping_scenes import pair_scenes
    from tracking.recordings.options import refuse_options

    refuse_options(vars(options), " ".join(READING), Path(options.names[0]), "a fit without --labels", SIMULATED)
    out, seeds = output_file(options.out, ".toml"), option_parsing.seeds(options.seeds)
    sample = sample_of(list(pair_scenes(options.names, seeds)))
    changes = sample_of(list(pair_scenes(options.events, seeds))) if options.events else None
    belief = fit_belief(sample, changes)
    log_odds = belief.log_odds(sample.values, sample.noise)[:, 0]
    scores = belief_scores(sample, log_odds + shifts_of_sample(sample, log_odds, belief.share))
    asked = [word for name in options.events for word in ("--events", name)]
    comments = _comments("grouping", options, asked, scores)
    write_file(out, belief.toml_text("\n".join(comments)).encode())
    return CommandResult({"file": out, "fitted": scores}, "\n".join([*comments[1:], _use("--grouping", out)]))


def _adapt_grouping(options: FitGroupingOptions) -> CommandResult:
    """Writes the default belief, adapted to the answers about people of the sources."""
    from sim.store.atomic import write_file
    from tracking.app.commands.group import opened_people
    from tracking.fitting.pair_answers import AnswerFile, answered_rows
    from tracking.fitting.place_belief import adapt
    from tracking.grouping.belief import default_belief
    from tracking.grouping.explained_pairs import ExplainedPairs
    from tracking.running.explained_people import explained_people

    if options.events:
        remedy = "leave --events out: answers tell nothing about events"
        raise InputError(place="--events", got="it with --labels", expected="one of the two", remedy=remedy)
    out, files = output_file(options.out, ".toml"), [AnswerFile.read(path) for path in options.labels]
    recordings, before = dict[str, ExplainedPairs](), default_belief()
    for name in options.names:
        for sequence, stored in zip(*opened_people(options, Path(name)), strict=True):
            run = None if stored is None else stored.read(sequence)
            again = f", recording {len(recordings) + 1}" if sequence.name in recordings else ""
            recordings[sequence.name + again] = explained_people(sequence, run, before)
    found = adapt(answered_rows(files, recordings))
    belief, (bias, near, motion) = found.belief, found.theta.tolist()
    asked = [word for path in options.labels for word in ("--labels", str(path))]
    lines = [f"{printable(file.recording)}: {file.counts()}" for file in files]
    lines += [
        f"the default belief agrees with {found.right[0]} of {found.count} answers, the adapted one with "
        f"{found.right[1]}",
        f"bias {bias:+.2f}, place × {1 + near:.2f}, motion and time × {1 + motion:.2f}",
    ]
    if len({x.answer for file in files for x in file.answers} - {"don't know"}) == 1:
        lines.append("all answers are of one kind: answer about other pairs, too")
    comments = [shlex.join(["flockscope", "fit", "grouping", *options.names, *asked]), *lines]
    write_file(out, belief.toml_text("\n".join(comments)).encode())
    fitted: dict[str, float] = {"answers": found.count, "agreed before": found.right[0], "agreed": found.right[1]}
    fitted |= {"bias": bias, "place": 1 + near, "motion": 1 + motion}
    return CommandResult({"file": out, "fitted": fitted}, "\n".join([*lines, _use("--grouping", out)]))


def _simulated(names: Iterable[str], seeds: range) -> Iterator[tuple[int, Truth]]:
    from scenarios.loading.resolve import resolve
    from tracking.fitting.grouping_scenes import simulated

    entries = [entry for name in names for entry in resolve(name)]
    return ((seed, simulated(entry, seed)) for entry in entries for seed in seeds)


def _use(option: str, out: Path) -> str:
    return f"→ {out}: use it as {shlex.join([option, str(out)])}"


def _comments(kind: str, options: FitJointOptions, more: Iterable[str], scores: Mapping[str, float]) -> list[str]:
    """Returns the command that fits, and a line of scores."""
    values = ", ".join(f"{name} {value:.4g}" for name, value in scores.items())
    command = shlex.join(["flockscope", "fit", kind, *options.names, "--seeds", options.seeds, *more])
    return [command, f"fitted, seeds {options.seeds}: {values}"]


def fit_joint(options: FitJointOptions) -> CommandResult:
    """Writes the fitted weights of the event classifier as a TOML file, with command and scores as comments."""
    from sim.store.atomic import write_file
    from tracking.fitting.joint_events import EventRows, event_rows, event_scores, fit_events
    from tracking.papers.joint.config import EVENT_TIME

    out, seeds = output_file(options.out, ".toml"), option_parsing.seeds(options.seeds)
    scenes = _simulated(options.names, seeds)
    rows = EventRows.joined(event_rows(truth, EVENT_TIME, seed) for seed, truth in scenes)
    params = fit_events(rows)
    scores = event_scores(rows, params)
    comments = _comments("joint", options, (), scores)
    body = [f"{name} = {value}" for name, value in params.items()]
    text = "\n".join([*(f"# {line}" for line in comments), 'tracker = "joint"', "", "[params]", *body, ""])
    write_file(out, text.encode())
    result = "\n".join([*comments[1:], "", *body, "", _use("--params", out)])
    return CommandResult({"file": out, "params": params, "fitted": scores}, result)


def fit_relational(options: FitRelationalOptions) -> CommandResult:
    """Writes the fitted parameters of `relational` as a TOML file."""
    from sim.store.atomic import write_file
    from tracking.fitting import relational
    from tracking.papers.relational.config import RelationalConfig

    out, seeds = output_file(options.out, ".toml"), option_parsing.seeds(options.seeds)
    truths = (truth for _, truth in _simulated(options.names, seeds))
    params = relational.fit_relational(truths, RelationalConfig().speed_ends)
    config = RelationalConfig.from_dict(dict(params), out)
    write_file(out, f"# flockscope fit relational\n{config.to_toml()}".encode())
    width, body = max(map(len, params)), config.as_dict()
    lines = [
        f"{name:<{width}}  {np.round(np.array(body[name]), 4)}  {RelationalConfig.known(name).unit}" for name in params
    ]
    lines += ["", _use("--params", out)]
    return CommandResult({"file": out, "params": params}, "\n".join(lines))
