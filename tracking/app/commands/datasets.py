"""`flockscope generate`, `replay` and `validate`: make and check datasets."""

from __future__ import annotations

from contextlib import suppress

from scenarios.errors import InputError, counted
from tracking.app import option_parsing
from tracking.app.command_options import GenerateOptions, ReplayCommandOptions, ValidateOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter


def generate(options: GenerateOptions) -> CommandResult:
    """Stores one sequence for every named scenario or suite entry and every seed, all seeds of an entry together."""
    from sim.dataset.generate import generate as make
    from sim.workers.start import WorkerOptions

    seeds = option_parsing.seeds(options.seeds)
    sensor = option_parsing.sensor_settings(options.sensor)
    settings = [*sensor, *option_parsing.scenario_settings(options.settings)]
    streams, images = option_parsing.pictures(options.streams, options.images)
    with ProgressMeter("generate") as meter:
        folders = make(
            options.names, seeds, options.out, set=settings, workers=WorkerOptions(options.workers, options.cluster),
            progress=meter.update, streams=streams, images=images, background=not options.no_background,
            stride=options.stride, pack=options.pack,
        )  # fmt: skip
    left_out = {name: reason.line() for name, reason in folders.left_out.items()}
    what, place, key = counted(len(folders), "sequence"), folders[0].parent, "sequences"
    if options.pack:
        what, place, key = counted(len(folders), "shard"), place.parent, "shards"
    lines = [f"{what} in {place}", *(f"left out: {name}: {reason}" for name, reason in left_out.items())]
    return CommandResult({key: folders, "folder": place, "left_out": left_out}, "\n".join(lines))


def validate(options: ValidateOptions) -> CommandResult:
    """Checks a generated sequence or dataset, or stored tracks; changes nothing."""
    from sim.store.validate import content_hash
    from sim.store.validate import validate as check

    folder = options.folder
    problems = check(folder)
    if not problems:
        content = None
        with suppress(InputError):  # of runs, and of what lies beside recordings, there is none
            content = content_hash(folder)
        text = f"{folder}: no problems" + ("" if content is None else f"; content {content[:16]}")
        return CommandResult({"problems": [], "content_hash": content}, text)
    lines = [problem.line() for problem in problems]
    listed = [problem.as_dict() for problem in problems]
    return CommandResult({"problems": listed, "error": listed[0]}, "\n".join(lines), code=1)


def replay(options: ReplayCommandOptions) -> CommandResult:
    """Stores one sequence for every recording of the source and every seed, all seeds of a recording together."""
    from scenarios.loading.resolve import load_observation
    from sim.dataset.generate import store_replays
    from sim.dataset.replay import Cut
    from tracking.app.sequence_workers import source_of
    from tracking.recordings.calibration import read_calibration

    seeds = option_parsing.seeds(options.seeds)
    streams, images = option_parsing.pictures(options.streams, options.images)
    if options.duration is not None and not options.duration > 0:
        raise InputError(place="--duration", got=options.duration, expected="seconds above 0", remedy="correct it")
    settings = option_parsing.scenario_settings(options.settings)
    view = load_observation(options.camera, [*option_parsing.sensor_settings(options.sensor), *settings])
    recordings = source_of(options, options.source, without="camera").open()
    calibration = None if options.calibration is None else read_calibration(options.calibration)
    cut = Cut(options.start, options.duration)
    with ProgressMeter("replay") as meter:
        folders = store_replays(
            recordings, view, seeds, options.out, cut=cut, calibration=calibration, streams=streams,
            images=images, background=not options.no_background, progress=meter.update,
        )  # fmt: skip
    text = f"{counted(len(folders), 'sequence')} in {folders[0].parent}"
    return CommandResult({"sequences": folders, "folder": folders[0].parent}, text)
