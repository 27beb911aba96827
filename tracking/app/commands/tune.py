"""`flockscope tune`: searches parameters as `tracking.tune`, and prints what was gained."""

from __future__ import annotations

from scenarios.errors import InputError, counted
from sim.store.own_files import output_file
from tracking.app import option_parsing
from tracking.app.command_options import TuneCommandOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter

COMMA_SEPARATED = ("only",)
SEEDS = ("seeds", "validation", "test")
NO_CHECK = "none"


def tune(options: TuneCommandOptions) -> CommandResult:
    """Searches parameters as `tracking.tune` does, writes the files of --out, and returns the gain on test scenes."""
    from tracking.app.commands.fit import scene_file
    from tracking.recordings.source import open_source
    from tracking.tuning.result import short
    from tracking.tuning.search import tune as search

    given = dict(vars(options))
    if (like := given.pop("like")) is not None:
        scene = output_file(options.out, ".toml").with_suffix(".scene.toml")
        scene_file(open_source(like, images=False), False, scene, ["fit", "scene", str(like)])
        given["suite"] = [*options.suite, str(scene)]
    elif not options.suite:
        remedy = "give --suite NAME, or --like SOURCE"
        raise InputError(place="--suite", got="no scenes", expected="scenes to tune on", remedy=remedy)
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
    taken = result.taken_over
    stored = f", stored {taken['stored']}" if taken["stored"] else ""
    counts = f"{counted(taken['trials'], 'trial')}, {counted(taken['episodes'], 'held-out episode')}"
    lines = [*result.lines(), *changed, f"taken over: {counts}{stored}"]
    text = "\n".join([*lines, f"{options.out}, all figures and plots beside it"])
    return CommandResult({**result.as_dict(), "taken_over": dict(taken), "file": options.out}, text)
