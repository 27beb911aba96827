"""`flockscope view` and `sheet`: pages and pictures of a sequence, or one for each sequence of a dataset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.types import Sequence
from tracking.app.answer import Answer
from tracking.app.meter import Meter
from tracking.app.paired import pair, results


def view(source: Path, tracks: Path | None, out: Path, *, fps: float | None, px_per_m: float | None) -> Answer:
    """A replay page of each sequence, with its tracks where they are given."""
    from tracking.app.view import view as page

    sequences = open_source(source, fps=fps, px_per_m=px_per_m)
    of = {} if tracks is None else {s.name: result for s, result in pair(sequences, results(tracks))}

    def draw(sequence: Sequence, path: Path) -> None:
        result = of.get(sequence.name)
        page(sequence, None if result is None else result.read(sequence), path)

    return _each("view", sequences, out, ".html", draw)


def sheet(source: Path, out: Path, *, frames: int, fps: float | None) -> Answer:
    """A contact sheet of each sequence."""
    from tracking.app.sheet import sheet as picture

    sequences = open_source(source, fps=fps)

    def draw(sequence: Sequence, path: Path) -> None:
        picture(sequence, path, frames)

    return _each("sheet", sequences, out, ".png", draw)


def _each(
    what: str, sequences: list[Sequence], out: Path, suffix: str, draw: Callable[[Sequence, Path], None]
) -> Answer:
    """One file for each sequence, each whole or not there: `out`, or NAME<suffix> in it where there are several."""
    files = _files(sequences, out, suffix)
    with Meter(what, len(files)) as meter:
        for sequence, path in zip(sequences, files, strict=True):
            draw(sequence, path)
            meter.step(sequence.name)
    return Answer({"files": files}, "\n".join(map(str, files)))


def _files(sequences: list[Sequence], out: Path, suffix: str) -> list[Path]:
    if len(sequences) == 1:
        if out.is_dir():
            raise InputError(
                file=out, place="--out", got="a folder", expected=f"a {suffix} file", remedy=f"write {out}/page{suffix}"
            )
        return [out]
    if out.suffix.lower() == suffix:
        raise InputError(
            file=out, place="--out", got=f"one file for {len(sequences)} sequences", expected="a folder",
            remedy="give a folder, or one sequence",
        )  # fmt: skip
    return [out / f"{sequence.name}{suffix}" for sequence in sequences]
