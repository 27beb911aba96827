"""`flockscope view`, `sheet` and `overlay`: write a page, picture or video for each sequence of a source."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from scenarios.errors import InputError, counted
from sim.store.own_files import address, output_file, output_paths, refuse_foreign_file
from sim.types import Sequence
from tracking.app.command_options import OverlayOptions, SheetOptions, ViewOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter, total_frames
from tracking.app.score_tables import checked_key
from tracking.app.scored_sequence import read_runs, run_names, scale_of_texts, scoring_jobs
from tracking.app.sequence_workers import over_sequences, source_of
from tracking.app.stored_tracks import find_tracks, match_tracks
from tracking.grouping.belief import Belief

if TYPE_CHECKING:
    from tracking.errors.found import RunErrors
    from tracking.running.run import TrackingRun

INDEX = "index.html"  # the report in the folder of the pages

Step = Callable[[str], None]  # Reports that one picture of the named sequence is done.

Write = Callable[[Sequence, Path, Step], None]  # Writes the file of one sequence.
Draw = Callable[[Sequence, "TrackingRun | None", Path, Step], None]  # The same, with the tracks to draw.


def view(options: ViewOptions) -> CommandResult:
    """Writes a replay page for each sequence, with its tracks if they are given, and a report on several sequences."""
    if options.by is not None:
        checked_key(options.by)
    belief = None if options.belief is None else Belief.from_toml(options.belief)
    sequences = source_of(options, options.source, images=True, without="box_scale").open()
    names = run_names(options.tracks)
    if len(sequences) == 1:
        if len(names) > 2:
            got, expected = counted(len(names), "run"), "one or two for a single sequence"
            raise InputError(place="TRACKS", got=got, expected=expected, remedy="give two, or the whole dataset")
        return _pages(options, sequences, names, belief)
    written = sequences if len(names) < 2 else []  # of several runs a report alone is written
    _files(written, _folder(options.out, ".html", len(sequences)), ".html")  # refuses files of others before all work
    unlabelled = next((sequence.name for sequence in sequences if sequence.load_truth is None), None)
    if len(names) > 1 and unlabelled is not None:
        expected, remedy = "labels, by which several runs are compared", "give one run, or one sequence"
        raise InputError(file=unlabelled, got="no labels", expected=expected, remedy=remedy)
    write = _report if names and unlabelled is None else _pages
    return write(options, sequences, names, belief)


def _pages(
    options: ViewOptions,
    sequences: list[Sequence],
    names: Mapping[str, str],
    belief: Belief | None,
    known: Mapping[str, RunErrors] = MappingProxyType({}),
) -> CommandResult:
    """Writes the page of each sequence. belief: whose evidence is shown, None: the default; known: errors of the only
    run, by sequence, if they have been found."""
    from tracking.app.replay_page.page import Run, write_page
    from tracking.app.replay_page.video import page_video
    from tracking.app.report.moments import shown_errors

    words = [*names] if len(names) > 1 else [""] * len(names)
    given = scoring_jobs(names.values(), sequences, options.box_scale)
    jobs = {sequence.name: job for sequence, job in zip(sequences, given, strict=True)}

    def write(sequence: Sequence, path: Path, step: Step) -> None:
        runs = read_runs(sequence, jobs[sequence.name])
        errors = [known.get(sequence.name) or shown_errors(sequence, run) for run in runs]
        shown = [Run(run, own.errors, word) for word, run, own in zip(words, runs, errors, strict=True)]
        write_page(sequence, shown, path, page_video(sequence, path, options.video, step), belief=belief)

    return _write_each("view", sequences, options.out, ".html", write, by_picture=options.video != "none")


def _report(
    options: ViewOptions, sequences: list[Sequence], names: Mapping[str, str], belief: Belief | None
) -> CommandResult:
    """Writes index.html, the report on all runs; for one run it links to the pages of the sequences."""
    from tracking.app.report.of_runs import judge, report_of_runs
    from tracking.app.report.page import check_packages, write_report

    check_packages()
    refuse_foreign_file(options.out / INDEX)
    index, pages = options.out / INDEX, CommandResult({"files": []})
    source = source_of(options, options.source, without="box_scale")
    jobs = scoring_jobs(names.values(), sequences, options.box_scale, oracles=True)
    found = list(over_sequences("report", judge, sequences, jobs, source, options.workers))
    if len(names) == 1:
        known = {sequence.name: one.errors[0] for sequence, one in zip(sequences, found, strict=True)}
        pages = _pages(options, sequences, names, belief, known)
    addresses = [address(Path(path.name)) for path in pages.data["files"]]
    files = dict(zip((sequence.name for sequence in sequences), addresses, strict=False))
    write_report(report_of_runs([*names], sequences, found, options.by, files), index)
    return CommandResult({"files": [index, *pages.data["files"]]}, f"{index}\n{pages.text}".rstrip())


def sheet(options: SheetOptions) -> CommandResult:
    """Writes a contact sheet, several frames in one PNG, for each sequence. The result's data: "files", their paths."""
    from tracking.app.pictures.contact_sheet import write_sheet

    def draw(sequence: Sequence, tracks: TrackingRun | None, path: Path, _: Step) -> None:
        write_sheet(sequence, path, options.frames, tracks)

    return _drawn("sheet", options, ".png", draw, by_picture=False)


def overlay(options: OverlayOptions) -> CommandResult:
    """Writes a video for each sequence with tracks, truth or both drawn over its pictures."""
    from tracking.app.pictures.overlay import write_overlay

    def draw(sequence: Sequence, tracks: TrackingRun | None, path: Path, step: Step) -> None:
        write_overlay(sequence, tracks, path, options.truth, step)

    return _drawn("overlay", options, ".mp4", draw)


def _drawn(
    what: str, options: SheetOptions | OverlayOptions, suffix: str, draw: Draw, by_picture: bool = True
) -> CommandResult:
    """Draws each sequence with its tracks, without any if the options name none."""
    sequences = source_of(options, options.source, images=True, without="box_scale").open()
    found = [] if options.tracks is None else match_tracks(sequences, find_tracks(options.tracks))
    stored = {sequence.name: tracks for sequence, tracks in found}
    factors = scale_of_texts(stored.values(), options.box_scale)

    def write(sequence: Sequence, path: Path, step: Step) -> None:
        draw(sequence, stored[sequence.name].read(sequence, factors) if stored else None, path, step)

    return _write_each(what, sequences, options.out, suffix, write, by_picture)


def _write_each(
    what: str, sequences: list[Sequence], out: Path, suffix: str, write: Write, by_picture: bool = True
) -> CommandResult:
    files = _files(sequences, out, suffix)
    with_pictures = [sequence for sequence in sequences if sequence.has_images and by_picture]
    with ProgressMeter(what, total_frames(with_pictures) if with_pictures else len(files)) as meter:
        for sequence, path in zip(sequences, files, strict=True):
            write(sequence, path, meter.step)
            if not with_pictures:
                meter.step(sequence.name)
    return CommandResult({"files": files}, "\n".join(map(str, files)))


def _files(sequences: list[Sequence], out: Path, suffix: str) -> list[Path]:
    if len(sequences) == 1:
        return [output_file(out, suffix)]
    files = output_paths(_folder(out, suffix, len(sequences)), [sequence.name for sequence in sequences], suffix)
    for file in files:
        refuse_foreign_file(file)
    return files


def _folder(out: Path, suffix: str, count: int) -> Path:
    if out.suffix.lower() == suffix:
        got, remedy = f"one file for {count} sequences", "give a folder, or one sequence"
        raise InputError(file=out, place="--out", got=got, expected="a folder", remedy=remedy)
    return out
