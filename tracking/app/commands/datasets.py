"""`flockscope generate`, `validate` and `export`: make, check and convert datasets."""

from __future__ import annotations

from pathlib import Path

from scenarios.printable import counted
from tracking.app import option_parsing
from tracking.app.command_options import CocoOptions, GenerateOptions, WebdatasetOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter


def generate(options: GenerateOptions) -> CommandResult:
    """Stores one sequence for every named scenario or suite entry and every seed, all seeds of an entry together.

    The result's data: "sequences", the folders, "folder", their parent, and "left_out", name and reason of each
    sequence whose script did not come true (at most 5 %). Stored sequences that are intact are kept.

    Raises InputError before anything is simulated for wrong options or scenarios, or a folder with another sequence. If
    sequences fail, the others are made first; then InputError is raised if all failures are wrong input, else
    WorkError. A full disk ends the work at once with WorkError.
    """
    from sim.dataset.generate import generate as make
    from sim.workers.start import WorkerOptions

    option_parsing.output_folder(options.out)
    seeds = option_parsing.seeds(options.seeds)
    sensor = option_parsing.sensor_settings(options.sensor)
    settings = [*sensor, *option_parsing.scenario_settings(options.settings)]
    streams, images = option_parsing.pictures(options.streams, options.images)
    with ProgressMeter("generate") as meter:
        folders = make(
            options.names, seeds, options.out, set=settings, workers=WorkerOptions(options.workers, options.cluster),
            progress=meter.update, streams=streams, images=images, stride=options.stride,
        )  # fmt: skip
    lines = [f"{counted(len(folders), 'sequence')} in {folders[0].parent}"]
    left_out = {name: reason.line() for name, reason in folders.left_out.items()}
    lines += [f"left out: {name}: {reason}" for name, reason in left_out.items()]
    data = {"sequences": folders, "folder": folders[0].parent, "left_out": left_out}
    return CommandResult(data, "\n".join(lines))


def validate(folder: Path) -> CommandResult:
    """Checks a generated sequence or dataset, or stored tracks, at the path `folder`; changes nothing.

    Without problems the result's data are "problems" ([]) and "content_hash" (64 hex digits, None for tracks), else
    "problems" (a dictionary each: file, place, got, expected, remedy) and "error" (the first of them). Then the exit
    code is 1 and the text has a line for each problem. Raises InputError if the folder does not exist or holds neither
    a sequence nor tracks.
    """
    from sim.io.store.validate import content_hash, holds_sequences
    from sim.io.store.validate import validate as check

    problems = check(folder)
    if not problems:
        content = content_hash(folder) if holds_sequences(folder) else None
        text = f"{folder}: no problems" + ("" if content is None else f"; content {content[:16]}")
        return CommandResult({"problems": [], "content_hash": content}, text)
    lines = [problem.line() for problem in problems]
    listed = [problem.as_dict() for problem in problems]
    return CommandResult({"problems": listed, "error": listed[0]}, "\n".join(lines), code=1)


def export_coco(options: CocoOptions) -> CommandResult:
    """Writes COCO files, one per split, of all sequences with labelled boxes at the path of the options.

    The result's data: "files", their paths, "file", the only path, None if there are several, and "root", the folder
    from which the names of pictures lead. Existing files are replaced. Raises InputError if the source cannot be
    opened, no sequence has labelled boxes, or a file cannot be written; WorkError if the disk is full.
    """
    from sim.io.export.coco import coco

    paths = coco(options.folder, options.out, options.min_visibility, person_class=options.person_class)
    root = options.folder if options.folder.is_dir() else options.folder.parent
    text = "\n".join([*map(str, paths), f"file names are relative to {root}"])
    return CommandResult({"file": paths[0] if len(paths) == 1 else None, "files": paths, "root": root}, text)


def export_kitti(source: Path, out: Path) -> CommandResult:
    """Writes pairs, disparities and calibrations of all sequences of a generated dataset into the folder `out`.

    The result's data: "folders", one per sequence. Files of an earlier export are replaced. Raises InputError if --out
    is wrong, the source is no intact generated dataset, or a sequence has no pairs; WorkError if the disk is full.
    """
    from sim.io.export.kitti import kitti

    folders = kitti(source, option_parsing.output_folder(out))
    return CommandResult({"folders": folders}, "\n".join(map(str, folders)))


def export_webdataset(options: WebdatasetOptions) -> CommandResult:
    """Writes tar shards of all sequences of a generated dataset into the folder of --out, and an index.json.

    The result's data: "shards", their paths, "bytes", their total, and "content_hash". Complete shards of an earlier
    run are kept. Raises InputError if --out or --shard-size is wrong, the source is no intact generated dataset, or the
    folder holds shards of another export; WorkError if the disk is full.
    """
    from sim.io.export.webdataset import size_of, webdataset

    out = option_parsing.output_folder(options.out)
    size = size_of(options.shard_size)
    with ProgressMeter("export") as meter:
        index = webdataset(options.folder, out, shard_size=size, samples=options.samples, progress=meter.update)
    shards = index["shards"]
    count, total = sum(len(s["sequences"]) for s in shards), sum(s["bytes"] for s in shards)
    packed = f"{counted(count, 'sequence')} in {counted(len(shards), 'shard')}"
    text = f"{packed}, {total / 1e6:.1f} MB; content {index['content_hash'][:16]}"
    files = [out / s["name"] for s in shards]
    return CommandResult({"shards": files, "bytes": total, "content_hash": index["content_hash"]}, text)
