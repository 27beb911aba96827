"""`flockscope view`, `sheet` and `overlay`: pages, pictures and videos of a sequence, or one for each of a dataset."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.types import Sequence
from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import pair, results
from tracking.run import TrackingRun

if TYPE_CHECKING:
    from tracking.app.pictures.overlay import HowTrue
    from tracking.app.replay_page.video import Video


Step = Callable[[str], None]
Draw = Callable[[Sequence, Path, Step], None]


@dataclass(frozen=True)
class Recording:
    """A source as a command is given it, with what it may be told about it (sim.io.source.open_source)."""

    source: Path
    fps: float | None = None
    px_per_m: float | None = None
    camera: Path | None = None

    def open(self) -> list[Sequence]:
        """Its sequences, with their pictures."""
        return open_source(self.source, fps=self.fps, px_per_m=self.px_per_m, camera=self.camera, images=True)


def view(recording: Recording, tracks: Path | None, out: Path, video: Video) -> CommandResult:
    """A replay page of each sequence, with its tracks where they are given."""
    from tracking.app.replay_page.page import view as page
    from tracking.app.replay_page.video import film

    sequences = recording.open()
    of = _tracks_of(sequences, tracks)

    def draw(sequence: Sequence, path: Path, step: Step) -> None:
        said = of(sequence)
        page(sequence, said, path, film=film(sequence, path, video, step))

    return _each("view", sequences, out, ".html", draw, _pictures(sequences) if video != "none" else 0)


def sheet(recording: Recording, out: Path, frames: int) -> CommandResult:
    """A contact sheet of each sequence."""
    from tracking.app.pictures.contact_sheet import sheet as picture

    def draw(sequence: Sequence, path: Path, _: Step) -> None:
        picture(sequence, path, frames)

    return _each("sheet", recording.open(), out, ".png", draw, 0)


def overlay(recording: Recording, tracks: Path | None, out: Path, truth: HowTrue | None) -> CommandResult:
    """A video of each sequence with its tracks, its truth or both drawn over it."""
    from tracking.app.pictures.overlay import overlay as film

    sequences = recording.open()
    of = _tracks_of(sequences, tracks)

    def draw(sequence: Sequence, path: Path, step: Step) -> None:
        film(sequence, of(sequence), path, truth, step)

    return _each("overlay", sequences, out, ".mp4", draw, _pictures(sequences))


def _tracks_of(sequences: list[Sequence], tracks: Path | None) -> Callable[[Sequence], TrackingRun | None]:
    """Reads the tracks of a sequence, if any were given."""
    found = {} if tracks is None else {s.name: result for s, result in pair(sequences, results(tracks))}

    def of(sequence: Sequence) -> TrackingRun | None:
        result = found.get(sequence.name)
        return None if result is None else result.read(sequence)

    return of


def _pictures(sequences: list[Sequence]) -> int | None:
    """How many pictures there are to be drawn, None where that is not known."""
    known = [sequence.length for sequence in sequences if sequence.has_images]
    return None if None in known else sum(length or 0 for length in known)


def _each(
    what: str, sequences: list[Sequence], out: Path, suffix: str, draw: Draw, pictures: int | None
) -> CommandResult:
    """One file for each sequence, each whole or not there: `out`, or NAME<suffix> in it where there are several.

    pictures: how often `draw` calls its step over all sequences; 0: never, files are counted.
    """
    files = _files(sequences, out, suffix)
    with ProgressMeter(what, len(files) if pictures == 0 else pictures) as meter:
        for sequence, path in zip(sequences, files, strict=True):
            draw(sequence, path, meter.step)
            if pictures == 0:
                meter.step(sequence.name)
    return CommandResult({"files": files}, "\n".join(map(str, files)))


def _files(sequences: list[Sequence], out: Path, suffix: str) -> list[Path]:
    if len(sequences) == 1:
        return [option_parsing.named(out, suffix)]
    if out.suffix.lower() == suffix:
        raise InputError(
            file=out, place="--out", got=f"one file for {len(sequences)} sequences", expected="a folder",
            remedy="give a folder, or one sequence",
        )  # fmt: skip
    return [out / f"{sequence.name}{suffix}" for sequence in sequences]
