"""`flockscope generate`, `validate` and `export`: make, check and convert datasets."""

from __future__ import annotations

from pathlib import Path

from tracking.app import option_parsing
from tracking.app.command_options import GenerateOptions, WebdatasetOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter


def generate(options: GenerateOptions) -> CommandResult:
    """Stores one sequence for every named scenario or suite entry and every seed; returns their folders.

    Raises InputError for wrong options, and WorkError if a sequence could not be made.
    """
    from sim.dataset.generate import generate as make
    from sim.workers.start import WorkerOptions

    option_parsing.output_folder(options.out)
    seeds = option_parsing.seeds(options.seeds)
    texts = [*option_parsing.sensor_settings(options.sensor), *options.settings]
    settings = option_parsing.scenario_settings(texts)
    streams, images = option_parsing.pictures(options.streams, options.images)
    with ProgressMeter("generate") as meter:
        folders = make(
            options.names, seeds, options.out, set=settings, workers=WorkerOptions(options.workers, options.cluster),
            progress=meter.update, streams=streams, images=images,
        )  # fmt: skip
    text = f"{len(folders)} sequences in {folders[0].parent}"
    return CommandResult({"sequences": folders, "folder": folders[0].parent}, text)


def validate(folder: Path) -> CommandResult:
    """Checks a sequence or dataset; returns its content hash, or with exit code 1 one line for each problem."""
    from sim.io.store.validate import content_hash
    from sim.io.store.validate import validate as check

    problems = check(folder)
    if not problems:
        content = content_hash(folder)
        text = f"{folder}: no problems; content {content[:16]}"
        return CommandResult({"problems": [], "content_hash": content}, text)
    lines = [problem.line() for problem in problems]
    listed = [problem.as_dict() for problem in problems]
    return CommandResult({"problems": listed, "error": listed[0]}, "\n".join(lines), code=1)


def export_coco(source: Path, out: Path) -> CommandResult:
    """Writes one COCO file of all labelled sequences of the source; returns its path."""
    from sim.io.export.coco import coco

    path = coco(source, out)
    return CommandResult({"file": path}, str(path))


def export_webdataset(options: WebdatasetOptions) -> CommandResult:
    """Writes tar shards of all sequences of the source; returns their paths, total bytes and content hash."""
    from sim.io.export.webdataset import size_of, webdataset

    out = option_parsing.output_folder(options.out)
    size = size_of(options.shard_size)
    with ProgressMeter("export") as meter:
        index = webdataset(options.folder, out, shard_size=size, samples=options.samples, progress=meter.update)
    shards = index["shards"]
    count, total = sum(len(s["sequences"]) for s in shards), sum(s["bytes"] for s in shards)
    text = f"{count} sequences in {len(shards)} shards, {total / 1e6:.1f} MB; content {index['content_hash'][:16]}"
    files = [out / s["name"] for s in shards]
    return CommandResult({"shards": files, "bytes": total, "content_hash": index["content_hash"]}, text)
