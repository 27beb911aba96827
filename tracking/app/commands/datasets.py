"""`flockscope generate`, `validate` and `export`: datasets made, checked and turned into other forms."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter


def generate(
    names: Iterable[str],
    seeds: str,
    out: Path,
    settings: Iterable[str],
    streams: str,
    images: str | None,
    *,
    workers: int,
    cluster: str | None,
) -> CommandResult:
    """Every named scenario or suite with every seed, as a dataset."""
    from sim.dataset.generate import generate as make
    from sim.workers.start import WorkerOptions

    option_parsing.folder(out)
    chosen, texts = option_parsing.seeds(seeds), option_parsing.scenario_settings(settings)
    wanted, kind = option_parsing.pictures(streams, images)
    with ProgressMeter("generate") as meter:
        folders = make(
            names, chosen, out, set=texts, workers=WorkerOptions(workers, cluster),
            progress=meter.update, streams=wanted, images=kind,
        )  # fmt: skip
    text = f"{len(folders)} sequences in {folders[0].parent}"
    return CommandResult({"sequences": folders, "folder": folders[0].parent}, text)


def validate(folder: Path) -> CommandResult:
    """Whether a sequence or dataset is whole and unaltered; code 1 where it is not."""
    from sim.io.store.validate import content_hash
    from sim.io.store.validate import validate as check

    problems = check(folder)
    if not problems:
        content = content_hash(folder)
        return CommandResult(
            {"problems": [], "content_hash": content}, f"{folder}: nothing wrong; content {content[:16]}"
        )
    lines = [problem.line() for problem in problems]
    found = [problem.as_dict() for problem in problems]
    return CommandResult({"problems": found, "error": found[0]}, "\n".join(lines), code=1)


def export_coco(source: Path, out: Path) -> CommandResult:
    """A COCO file of every sequence."""
    from sim.io.export.coco import coco

    path = coco(source, out)
    return CommandResult({"file": path}, str(path))


def export_webdataset(source: Path, out: Path, shard_size: str, samples: str) -> CommandResult:
    """Tar shards of every sequence."""
    from sim.io.export.webdataset import size_of, webdataset

    option_parsing.folder(out)
    with ProgressMeter("export") as meter:
        index = webdataset(source, out, shard_size=size_of(shard_size), samples=samples, progress=meter.update)
    shards = index["shards"]
    count, size = sum(len(s["sequences"]) for s in shards), sum(s["bytes"] for s in shards)
    text = f"{count} sequences in {len(shards)} shards, {size / 1e6:.1f} MB; content {index['content_hash'][:16]}"
    files = [out / s["name"] for s in shards]
    return CommandResult({"shards": files, "bytes": size, "content_hash": index["content_hash"]}, text)
