"""`flockscope view`, `sheet` and `overlay`: write a page, picture or video for each sequence of a source."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.errors import InputError
from sim.io.files.own_files import output_paths, refuse_foreign_file
from sim.io.source import open_source
from sim.types import Sequence
from tracking.app import option_parsing
from tracking.app.command_options import OverlayOptions, SheetOptions, ViewOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter, total_frames
from tracking.app.stored_tracks import find_tracks, match_tracks
from tracking.running.run import TrackingRun

if TYPE_CHECKING:
    from tracking.errors.found import FoundError

Step = Callable[[str], None]  # Reports that one picture of the named sequence is done.

Write = Callable[[Sequence, Path, Step], None]  # Writes the file of one sequence.


def view(options: ViewOptions) -> CommandResult:
    """Writes a replay page for each sequence, with its tracks if they are given."""
    from tracking.app.replay_page.page import write_page
    from tracking.app.replay_page.video import page_video

    sequences = _open(options)
    tracks_of = _tracks_reader(sequences, options.tracks)

    def write(sequence: Sequence, path: Path, step: Step) -> None:
        tracks = tracks_of(sequence)
        video, errors = page_video(sequence, path, options.video, step), errors_on_page(sequence, tracks)
        write_page(sequence, tracks, path, video=video, errors=errors)

    pictures = _picture_count(sequences) if options.video != "none" else 0
    return _write_each("view", sequences, options.out, ".html", write, pictures)


def errors_on_page(sequence: Sequence, tracks: TrackingRun | None) -> list[FoundError]:
    """Returns the errors of people and groups that a page shows; a warning says why there are none of them."""
    from tracking.errors.found import errors_of_run

    if tracks is None or sequence.truth is None or any(t.unit == "group" for t in tracks):
        return []
    try:
        return errors_of_run(sequence, tracks, costs=False).errors
    except InputError as error:
        warnings.warn(f"{sequence.name}: the page shows no errors: {error.got}", stacklevel=2)
        return []


def sheet(options: SheetOptions) -> CommandResult:
    """Writes a contact sheet, several frames in one PNG, for each sequence. The result's data: "files", their paths."""
    from tracking.app.pictures.contact_sheet import write_sheet

    def write(sequence: Sequence, path: Path, _: Step) -> None:
        write_sheet(sequence, path, options.frames)

    sequences = open_source(options.source, fps=options.fps, images=True)
    return _write_each("sheet", sequences, options.out, ".png", write, 0)


def overlay(options: OverlayOptions) -> CommandResult:
    """Writes a video for each sequence with tracks, truth or both drawn over its pictures."""
    from tracking.app.pictures.overlay import write_overlay

    sequences = _open(options)
    tracks_of = _tracks_reader(sequences, options.tracks)

    def write(sequence: Sequence, path: Path, step: Step) -> None:
        write_overlay(sequence, tracks_of(sequence), path, options.truth, step)

    return _write_each("overlay", sequences, options.out, ".mp4", write, _picture_count(sequences))


def _open(options: ViewOptions | OverlayOptions) -> list[Sequence]:
    return open_source(
        options.source, fps=options.fps, px_per_m=options.px_per_m, camera=options.camera, images=True
    )  # fmt: skip


def _tracks_reader(sequences: list[Sequence], tracks: Path | None) -> Callable[[Sequence], TrackingRun | None]:
    stored = {} if tracks is None else {s.name: found for s, found in match_tracks(sequences, find_tracks(tracks))}

    def read(sequence: Sequence) -> TrackingRun | None:
        found = stored.get(sequence.name)
        return None if found is None else found.read(sequence)

    return read


def _picture_count(sequences: list[Sequence]) -> int | None:
    return total_frames(sequence for sequence in sequences if sequence.has_images)


def _write_each(
    what: str, sequences: list[Sequence], out: Path, suffix: str, write: Write, pictures: int | None
) -> CommandResult:
    files = _files(sequences, out, suffix)
    with ProgressMeter(what, len(files) if pictures == 0 else pictures) as meter:
        for sequence, path in zip(sequences, files, strict=True):
            write(sequence, path, meter.step)
            if pictures == 0:
                meter.step(sequence.name)
    return CommandResult({"files": files}, "\n".join(map(str, files)))


def _files(sequences: list[Sequence], out: Path, suffix: str) -> list[Path]:
    if len(sequences) == 1:
        return [option_parsing.output_file(out, suffix)]
    if out.suffix.lower() == suffix:
        raise InputError(
            file=out, place="--out", got=f"one file for {len(sequences)} sequences", expected="a folder",
            remedy="give a folder, or one sequence",
        )  # fmt: skip
    files = output_paths(out, [sequence.name for sequence in sequences], suffix)
    for file in files:
        refuse_foreign_file(file)
    return files
