"""`flockscope minimize`: the smallest scene in which a tracker still fails, as a scenario file and a replay page."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError, counted, printable
from scenarios.loading.resolve import load, names, resolve
from scenarios.loading.toml_files import dump
from scenarios.schema.scenario import Scenario
from sim.draws import drawn
from sim.sequence import simulate
from sim.store.atomic import write_file
from sim.store.own_files import output_file, refuse_foreign_file
from sim.types import Sequence
from tracking.app.command_options import MinimizeOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.score_tables import number, table
from tracking.app.tracker_setup import TrackerSetup
from tracking.episodes.episode import streams_for
from tracking.grouping.grouping_choice import default_grouping
from tracking.grouping.link_rule import LinkRule
from tracking.running.tracker_registry import find
from tracking.running.used_files import UsedFiles, used
from tracking.stress.failures import CRASH, Failure, Judgement, parse_failure, play_episode
from tracking.stress.minimize import Minimizer
from tracking.stress.reductions import OBSTACLES, difficulties, table_of
from tracking.stress.sweep import generate_command

LISTED = ("HOTA", "group_F1", "IDSW")
SEQUENCES = ("manifest.json", "*/manifest.json", "*/*/manifest.json")  # below a folder with a dataset


@dataclass(frozen=True)
class Scene:
    """A scenario with the seed of one sequence, and the number of the suite's copy that it is."""

    scenario: Scenario
    seed: int
    repeat: int = 0


def minimize(options: MinimizeOptions) -> CommandResult:
    """Searches the smallest scene in which the tracker fails, writes it as a scenario file and a replay page, and
    returns what was removed."""
    failure = parse_failure(options.condition)
    out = output_file(options.out, ".toml")
    page = out.with_suffix(".html")
    refuse_foreign_file(page)
    if out.resolve() == Path(options.source).resolve():
        got, remedy = "the scene itself", "choose another file"
        raise InputError(file=out, place="--out", got=got, expected="another file", remedy=remedy)
    scene, setup = _scene_and_tracker(options)
    streams, files = streams_for(setup.tracker, setup.detections), UsedFiles()

    def play(scenario: Scenario, seed: int, repeat: int = 0) -> Judgement:
        meter.step(f"{scenario.duration:g} s, {counted(len(scenario.group), 'group')}")
        found = play_episode(setup.run, streams, failure, scenario, seed, repeat)
        files.add(setup.tracker, used(find(setup.tracker)))
        return found

    with ProgressMeter("minimize", options.episodes) as meter:
        search = Minimizer(play, failure, scene.seed, options.confirm, options.episodes, options.minutes)
        try:
            search.run(scene.scenario, scene.repeat)
        except KeyboardInterrupt:
            if search.trail:
                _write(out, search, scene, setup)
            raise
        seeds = [scene.seed, *search.fresh_seeds()]
        outcomes = {seed: search.outcome(search.smallest, seed, budget=False) for seed in seeds}
    small = _write(out, search, scene, setup)
    _write_page(page, setup, failure, simulate(small, scene.seed, 0, streams))
    return _result(search, scene, setup, out, outcomes)


def _scene_and_tracker(options: MinimizeOptions) -> tuple[Scene, TrackerSetup]:
    source = Path(options.source)
    if source.is_dir() and options.source not in names():  # as elsewhere, a name of the catalogue counts first
        if options.tracker is not None or options.seed is not None:
            got, expected = "--tracker or --seed beside a run", "a run, or a scenario with both"
            raise InputError(place="SOURCE", got=got, expected=expected, remedy="leave them out")
        return _of_run(source)
    entry, *others = resolve(options.source)
    if others or options.tracker is None:
        got = f"a suite of {len(others) + 1} scenes" if others else "no --tracker"
        expected, remedy = "one scene and its tracker, or a run", "give a scenario with --tracker, or a run"
        raise InputError(place="SOURCE", got=got, expected=expected, remedy=remedy)
    find(options.tracker)
    seed = options.seed or 0
    return Scene(drawn(entry.scenario, seed, entry.repeat), seed, entry.repeat), TrackerSetup(options.tracker)


def _of_run(folder: Path) -> tuple[Scene, TrackerSetup]:
    """Returns the scene and the tracker of a run, with its parameters and inputs."""
    from sim.store.seal import check_run, is_run, read_manifest
    from sim.types import BACKGROUNDS, OWN_BACKGROUND

    info = check_run(folder) if is_run(folder) else {}
    sequence = _sequence_of(info) if info else None
    manifest = {} if sequence is None else read_manifest(sequence)
    rule, got = info.get("grouping"), ""
    if rule == default_grouping().as_dict():
        rule = None
    if sequence is None:
        got = f"tracks of {info['sequence']}, which is not below this folder" if info else "no run"
    elif "origin" in manifest or manifest.get("stride", 1) != 1:
        got = "tracks of a recording, or of frames with a stride"
    elif info.get("background") not in (None, OWN_BACKGROUND, f"{BACKGROUNDS} frames"):
        got = f"--background {info['background']}"
    elif rule is not None and rule.get("grouping") is not None:
        got = "--grouping with a belief of another file"
    if sequence is None or got:
        expected = "a run of `track` on a generated sequence below this folder, that can be repeated"
        remedy = "run it above the dataset, or give a scenario with --tracker; recordings cannot be made smaller"
        raise InputError(file=folder, got=got, expected=expected, remedy=remedy)
    kind = getattr(find(info["tracker"]), "config_class", None)
    setup = TrackerSetup(
        info["tracker"], None if kind is None else kind.from_dict(info["config"], folder), info["detections"],
        info["sensor"] or {}, info["seed"], None if rule is None else LinkRule.from_dict(rule),
    )  # fmt: skip
    return Scene(load(sequence / "scenario.toml"), manifest["seed"], manifest["repeat"]), setup


def _sequence_of(info: Mapping[str, Any]) -> Path | None:
    """Returns the sequence of a run, which is looked for below the working folder, by name and hash of the truth."""
    from sim.store.seal import read_manifest

    for pattern in SEQUENCES:
        for path in sorted(Path().glob(f"*/{pattern}")):
            if path.parent.name == info["sequence"] and read_manifest(path.parent)["truth_hash"] == info["truth_hash"]:
                return path.parent
    return None


def _write(out: Path, search: Minimizer, scene: Scene, setup: TrackerSetup) -> Scenario:
    """Writes the smallest scene as a scenario file, and returns it as it is read again."""
    about = f"{scene.scenario.name} made small: {setup.tracker} has {search.failure.text}"
    small = dump(search.smallest.model_copy(update={"about": about}), defaults=False)
    small = re.sub(r"^(size = \d+)\.0$", r"\1", small, flags=re.MULTILINE)  # of groups
    write_file(out, f"# {_command(out, scene, setup)}\n{small}".encode())
    return load(out)


def _command(out: Path, scene: Scene, setup: TrackerSetup) -> str:
    streams = ",".join(streams_for(setup.tracker, setup.detections)) or "none"
    return f"{generate_command(str(out), scene.seed, (), f'{out.stem}-data')} --streams {streams}"


def _write_page(path: Path, setup: TrackerSetup, failure: Failure, sequence: Sequence) -> None:
    from tracking.app.replay_page.page import Run, write_page
    from tracking.app.report.moments import shown_errors

    if failure.kind == CRASH:
        write_page(sequence, [], path)
        return
    with warnings.catch_warnings(action="ignore", category=UserWarning):  # as in the search
        tracks = setup.run(sequence)
    errors = shown_errors(sequence, tracks).errors
    own = (one.error.start for one in errors if one.error.kind == failure.kind)
    write_page(sequence, [Run(tracks, errors, setup.tracker)], path, start=next(own, 1))


def _result(
    search: Minimizer, scene: Scene, setup: TrackerSetup, out: Path, outcomes: dict[int, Judgement]
) -> CommandResult:
    small = search.smallest
    fails = {seed: search.fails(small, seed) for seed in outcomes}
    fresh = [fails[seed] for seed in outcomes if seed != scene.seed]
    before, after = (_counts(s, o) for s, o in ((scene.scenario, search.first), (small, outcomes[scene.seed])))
    known = table_of(small)
    data = {
        "while": search.failure.text, "tracker": setup.tracker, "seed": scene.seed, "before": before, "after": after,
        "needed": [piece.words(known) for piece in difficulties(small)], "complete": search.complete,
        "episodes": search.played, "fresh": len(fresh), "fails": sum(fresh),
        "seeds": [
            {"seed": seed, "fails": fails[seed], "scores": dict(outcome.scores)} for seed, outcome in outcomes.items()
        ],
        "command": _command(out, scene, setup), "file": out, "page": out.with_suffix(".html"),
    }  # fmt: skip
    return CommandResult(data, _text(data))


def _counts(scenario: Scenario, outcome: Judgement) -> dict[str, float]:
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
    return "\n".join([*map(printable, lines), "", shown, printable(data["command"]), printable(files)])
