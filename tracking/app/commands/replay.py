"""`flockscope replay`: renders recorded trajectories with a simulated camera and sensor and stores a dataset."""

from __future__ import annotations

from scenarios.errors import InputError
from scenarios.printable import counted
from tracking.app import option_parsing
from tracking.app.command_options import ReplayCommandOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter


def replay(options: ReplayCommandOptions) -> CommandResult:
    """Stores one sequence for every recording of the source and every seed, all seeds of a recording together."""
    from scenarios.loading.resolve import load_observation
    from sim.dataset.generate import ReplayOptions, store_replays
    from sim.dataset.replay import Cut
    from sim.io.source import open_source

    option_parsing.output_folder(options.out)
    seeds = option_parsing.seeds(options.seeds)
    streams, images = option_parsing.pictures(options.streams, options.images)
    if options.duration is not None and options.duration <= 0:
        raise InputError(place="--duration", got=options.duration, expected="seconds above 0", remedy="correct it")
    settings = option_parsing.scenario_settings(options.settings)
    view = load_observation(options.camera, [*option_parsing.sensor_settings(options.sensor), *settings])
    recordings = open_source(options.source, fps=options.fps, images=False)
    replays = ReplayOptions(view, Cut(options.start, options.duration), options.calibration, streams, images)
    with ProgressMeter("replay") as meter:
        folders = store_replays(recordings, replays, seeds, options.out, meter.update)
    text = f"{counted(len(folders), 'sequence')} in {folders[0].parent}"
    return CommandResult({"sequences": folders, "folder": folders[0].parent}, text)
