"""`flockscope minimize`: the smallest scene in which a tracker still fails, as a scenario file and a replay page."""

from __future__ import annotations

import shlex
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, counted, printable
from scenarios.loading.resolve import load, names, resolve
from scenarios.loading.toml_files import dump, toml_value
from scenarios.schema.scenario import Scenario
from sim.io.files.atomic import write_file
from sim.io.files.own_files import refuse_foreign_file
from tracking.app import option_parsing
from tracking.app.command_options import MinimizeOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import number, table
from tracking.app.progress import ProgressMeter
from tracking.running.tracker_registry import find, located
from tracking.stress.failures import CRASH, EpisodeOf, Outcome, Subject, parse_failure, play_episode
from tracking.stress.minimize import Search
from tracking.stress.reductions import OBSTACLES, difficulties, table_of

LISTED = ("HOTA", "group_F1", "IDSW")
NO_RECORDING = "recordings cannot be made smaller"
SEQUENCES = ("manifest.json", "*/manifest.json", "*/*/manifest.json")  # below a folder with a dataset


@dataclass(frozen=True)
class Scene:
    """A scenario with the seed of one sequence, and the number of the suite's copy that it is."""

    scenario: Scenario
    seed: int
    repeat: int = 0


def minimize(options: MinimizeOptions) -> CommandResult:
    """Searches the smallest scene, writes it as a scenario file and a replay page, and returns what was removed."""
    from sim.workers.pool import results_in_order, start_workers

    failure = parse_failure(options.condition)
    out = option_parsing.output_file(options.out, ".toml")
    page = out.with_suffix(".html")
    refuse_foreign_file(page)
    if out.resolve() == Path(options.source).resolve():
        got, remedy = "the scene itself", "choose another file"
        raise InputError(file=out, place="--out", got=got, expected="another file", remedy=remedy)
    scene, subject = _scene_and_subject(options)
    with start_workers(options.workers) as run, ProgressMeter("minimize", options.episodes) as meter:
        search = Search(
            subject, failure, scene.seed, options.confirm,
            lambda episodes: results_in_order(run, play_episode, episodes),
            options.episodes, options.minutes, meter.step,
        )  # fmt: skip
        try:
            search.run(scene.scenario, scene.repeat)
        except KeyboardInterrupt:
            if search.trail:
                _write(out, search, scene)
            raise
        seeds = [scene.seed, *search.fresh_seeds()]
        with closing(search.outcomes([(search.smallest, seed) for seed in seeds], budget=False)) as played:
            outcomes = list(played)
    small = _write(out, search, scene)
    _write_page(page, EpisodeOf(subject, failure, small, scene.seed))
    return _result(search, scene, out, dict(zip(seeds, outcomes, strict=True)))


def _scene_and_subject(options: MinimizeOptions) -> tuple[Scene, Subject]:
    from sim.io.store.seal import is_run

    source, run = Path(options.source), options.run
    stored = source.is_dir() and options.source not in names()  # as elsewhere, a name of the catalogue counts first
    if run is None and stored and is_run(source):
        source, run = _sequence_of(source), source
    if (options.tracker is None) == (run is None):
        got = "nothing" if run is None else "a tracker beside a run"
        raise InputError(place="--tracker", got=got, expected="a tracker, or a run", remedy="give one of both")
    if stored:
        scene = _stored_scene(source, options.seed)
    else:
        entry, *others = resolve(options.source)
        if others:
            got, remedy = f"a suite of {len(others) + 1} scenes", "give a scenario, or one sequence that was generated"
            raise InputError(place="SOURCE", got=got, expected="one scene", remedy=remedy)
        scene = Scene(entry.scenario, options.seed or 0, entry.repeat)
    if options.tracker is None:
        return scene, _tracked(source, options.run or Path(options.source))
    find(options.tracker)
    return scene, Subject(located(options.tracker), options.tracker)


def _stored_scene(folder: Path, seed: int | None) -> Scene:
    from sim.io.store.seal import is_sequence, read_manifest

    got, manifest = "", read_manifest(folder) if is_sequence(folder) else None
    if manifest is None:
        got = "no generated sequence"
    elif "origin" in manifest or manifest.get("stride", 1) != 1:
        got = "a replay of a recording" if "origin" in manifest else f"frames with stride {manifest['stride']}"
    elif seed is not None:
        got = f"--seed {seed} beside a sequence with a seed of its own"
    if manifest is None or got:
        expected, remedy = "one whole generated sequence, a scenario, or tracks of one", f"give one; {NO_RECORDING}"
        raise InputError(file=folder, got=got, expected=expected, remedy=remedy)
    return Scene(load(folder / "scenario.toml"), manifest["seed"], manifest["repeat"])


def _sequence_of(run: Path) -> Path:
    """Returns the sequence of a run, which is looked for below the working folder, by name and hash of the truth."""
    from sim.io.store.seal import check_run, read_manifest

    info = check_run(run)
    for pattern in SEQUENCES:
        for path in sorted(Path().glob(f"*/{pattern}")):
            if path.parent.name == info["sequence"] and read_manifest(path.parent)["truth_hash"] == info["truth_hash"]:
                return path.parent
    got = f"tracks of {info['sequence']}, which is not below this folder"
    remedy = f"give the sequence, too: flockscope minimize SEQUENCE RUN; {NO_RECORDING}"
    raise InputError(file=run, got=got, expected="a generated sequence", remedy=remedy)


def _tracked(source: Path, path: Path) -> Subject:
    """Returns the tracker of a run of the sequence, with its parameters and inputs."""
    from sim.io.source import open_source
    from sim.types import BACKGROUNDS, OWN_BACKGROUND
    from tracking.app.stored_tracks import find_tracks, match_tracks
    from tracking.grouping.grouping_choice import default_grouping

    if not source.is_dir():
        got, remedy = f"a run beside {source}", "give the sequence that was tracked"
        raise InputError(place="SOURCE", got=got, expected="a generated sequence", remedy=remedy)
    ((sequence, stored),) = match_tracks(open_source(source), find_tracks(path))
    stored.read(sequence)
    info, rule, got = stored.info, stored.info.get("grouping"), ""
    if rule == default_grouping().as_dict():
        rule = None
    if not info:
        got = "tracks of another program"
    elif info.get("background") not in (None, OWN_BACKGROUND, f"{BACKGROUNDS} frames"):
        got = f"--background {info['background']}"
    elif rule is not None and rule.get("grouping") is not None:
        got = "--grouping with a belief of another file"
    if got:
        raise InputError(file=path, got=got, expected="a run that can be repeated", remedy="track it again without it")
    find(info["tracker"])
    return Subject(
        located(info["tracker"]), info["tracker"], info["config"] or None, info["detections"], info["sensor"] or {},
        info["seed"], rule,
    )  # fmt: skip


def _write(out: Path, search: Search, scene: Scene) -> Scenario:
    """Writes the smallest scene as a scenario file, and returns it as it is read again."""
    about = f"{scene.scenario.name} made small: {search.subject.name} has {search.failure.text}"
    small = search.smallest.model_copy(update={"about": about})
    lines = "".join(f"# {line}\n" for line in _commands(search, out, scene.seed, small))
    write_file(out, (lines + dump(small, defaults=False)).encode())
    return load(out)


def _commands(search: Search, out: Path, seed: int, small: Scenario) -> list[str]:
    """Returns the commands that generate the scene and track it."""
    from sim.dataset.splits import split_of
    from tracking.environment.episodes import streams_for

    subject, data = search.subject, f"{out.stem}-data"
    streams = [s for s in streams_for(subject.tracker, subject.detections) if s != "background"]
    kind = getattr(find(subject.tracker), "config_class", None)
    usual = kind().as_dict() if kind is not None else {}
    values = {key: value for key, value in (subject.config or {}).items() if usual.get(key) != value}
    values |= {f"sensor.{key}": value for key, value in subject.sensor.items()}
    more = [f"--detections {subject.detections}"] if subject.detections else []
    more += [f"--seed {subject.seed}"] if subject.seed else []
    more += [f"--set {shlex.quote(f'{key}={toml_value(value)}')}" for key, value in values.items()]
    more += ["--grouping rule"] if subject.rule is not None else []
    sequence = f"{data}/flockscope-{split_of(range(seed, seed + 1))}/{small.name}-s{seed:05d}"
    return [
        f"flockscope generate {shlex.quote(str(out))} --seeds {seed} --streams {','.join(streams) or 'none'} "
        f"--out {shlex.quote(data)}",
        " ".join(["flockscope track", shlex.quote(subject.name), shlex.quote(sequence), *more])
        + f" --out {shlex.quote(f'{out.stem}-tracks')}",
    ]


def _write_page(path: Path, episode: EpisodeOf) -> None:
    from tracking.app.replay_page.page import Run, write_page
    from tracking.app.report.moments import shown_errors

    sequence = episode.sequence()
    if episode.failure.kind == CRASH:
        write_page(sequence, Run(), path)
        return
    tracks = episode.subject.run(sequence)
    errors = shown_errors(sequence, tracks).errors
    own = (one.error.start for one in errors if one.error.kind == episode.failure.kind)
    write_page(sequence, Run(tracks, errors, episode.subject.name), path, start=next(own, 1))


def _result(search: Search, scene: Scene, out: Path, outcomes: dict[int, Outcome]) -> CommandResult:
    small, failure = search.smallest, search.failure
    fails = {seed: outcome.problem is None and failure.holds(outcome) for seed, outcome in outcomes.items()}
    fresh = [fails[seed] for seed in outcomes if seed != scene.seed]
    before, after = (_counts(s, o) for s, o in ((scene.scenario, search.first), (small, outcomes[scene.seed])))
    known = table_of(small)
    data = {
        "while": failure.text, "tracker": search.subject.name, "seed": scene.seed, "before": before, "after": after,
        "needed": [piece.words(known) for piece in difficulties(small)], "complete": search.complete,
        "episodes": search.played, "fresh": len(fresh), "fails": sum(fresh),
        "seeds": [
            {"seed": seed, "fails": fails[seed], "scores": dict(outcome.scores)} for seed, outcome in outcomes.items()
        ],
        "commands": _commands(search, out, scene.seed, small), "file": out, "page": out.with_suffix(".html"),
    }  # fmt: skip
    return CommandResult(data, _text(data))


def _counts(scenario: Scenario, outcome: Outcome) -> dict[str, float]:
    """Returns how much there is of everything in a scene."""
    obstacles = {key: len(getattr(scenario.world, key)) for key in OBSTACLES}
    return {
        "people": outcome.people, "s": scenario.duration, "orders": len(scenario.event), **obstacles,
        "difficulties": len(difficulties(scenario)),
    }  # fmt: skip


def _text(data: dict[str, Any]) -> str:
    before, after, complete = data["before"], data["after"], data["complete"]
    changes = ", ".join(f"{before[key]:g} {key} → {after[key]:g}" for key in before if before[key])
    confirmed = f"fails on {data['fails']} of {counted(data['fresh'], 'fresh seed')}"
    confirmed = confirmed if data["fresh"] else "not confirmed on other seeds"
    state = "no single piece can be removed" if complete else "stopped early: more can perhaps be removed"
    lines = [f"{changes}; {confirmed}; {counted(data['episodes'], 'episode')}; {state}"]
    if data["needed"]:
        lines.append(f"difficulties that {'it needs' if complete else 'are left'}: {', '.join(data['needed'])}")
    scored = data["while"].split("<")[0].split(">")[0]
    keys = [*LISTED, *({scored} & data["seeds"][0]["scores"].keys() - {*LISTED})]
    rows = [
        [str(row["seed"]), "yes" if row["fails"] else "no",
         *(number(key, row["scores"].get(key, float("nan"))) for key in keys)]
        for row in data["seeds"]
    ]  # fmt: skip
    files = f"{data['file']}, and a replay of seed {data['seed']}: {data['page']}"
    shown = table("", (), ["seed", data["while"], *keys], rows)
    return "\n".join([*map(printable, lines), "", shown, *map(printable, data["commands"]), printable(files)])
