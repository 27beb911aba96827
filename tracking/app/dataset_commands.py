"""`flockscope generate`, `validate` and `export`: datasets made, checked and turned into other forms."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from scenarios.errors import InputError
from tracking.app import options
from tracking.app.answer import Answer
from tracking.app.meter import Meter


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
) -> Answer:
    """Every named scenario or suite with every seed, as a dataset."""
    from sim.generate import generate as make
    from sim.io.streams import coding

    options.folder(out)
    chosen = options.seeds(seeds)
    texts, wanted = options.scenario_settings(settings), options.streams(streams)
    if images is not None and coding(wanted, images) is None:
        got, remedy = f"{images} with --streams {streams}", "leave --images out: ids and disparity are always png"
        raise InputError(place="--images", got=got, expected="left, right or background", remedy=remedy)
    with Meter("generate") as meter:
        folders = make(
            names, chosen, out, set=texts, workers=workers, cluster=cluster, progress=meter.update,
            streams=wanted, images=images or "jpg",
        )  # fmt: skip
    text = f"{len(folders)} sequences in {folders[0].parent}"
    return Answer({"sequences": folders, "folder": folders[0].parent}, text)


def validate(folder: Path) -> Answer:
    """Whether a sequence or dataset is whole and unaltered; code 1 where it is not."""
    from sim.io.validate import validate as check

    problems = check(folder)
    if not problems:
        return Answer({"problems": []}, f"{folder}: nothing wrong")
    lines = [problem.line() for problem in problems]
    found = [problem.as_dict() for problem in problems]
    return Answer({"problems": found, "error": found[0]}, "\n".join(lines), code=1)


def export_coco(source: Path, out: Path) -> Answer:
    """A COCO file of every sequence."""
    from sim.io.export import coco

    path = coco(source, out)
    return Answer({"file": path}, str(path))
