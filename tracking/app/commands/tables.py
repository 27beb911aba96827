"""`flockscope export csv`, `parquet`, `trajnet` and `pedpy`: tables of stored runs and of the truth of sequences."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.io.export.tidy_tables import Form, Places, TidyTables, parse_places, run_tables, truth_tables, write_tables
from sim.io.files.own_files import output_paths
from sim.io.formats.mot_folder import frame_rate
from sim.io.formats.options import refuse_options
from sim.io.source import holds_sequences, open_source
from sim.io.store.seal import WHOLE, is_run, is_sequence, run_folder
from sim.io.store.track_files import read_checked_tracks
from sim.types import Sequence
from tracking.app import option_parsing
from tracking.app.command_options import CsvOptions, ParquetOptions, PedpyOptions, TrajnetOptions
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import StoredTracks, find_tracks, run_folders


def export_csv(options: CsvOptions) -> CommandResult:
    """Writes the tables of every run or sequence as CSV."""
    return _export(options, "csv", parse_places(options.line, options.zone))


def export_parquet(options: ParquetOptions) -> CommandResult:
    """Writes the tables of every run or sequence as Parquet."""
    return _export(options, "parquet", parse_places(options.line, options.zone))


def export_trajnet(options: TrajnetOptions) -> CommandResult:
    """Writes the people of every run or sequence as TrajNet++."""
    return _export(options, "trajnet", {})


def export_pedpy(options: PedpyOptions) -> CommandResult:
    """Writes the people of every run or sequence as a text of PedPy and JuPedSim."""
    return _export(options, "pedpy", {})


def _export(options: TrajnetOptions, form: Form, places: Places) -> CommandResult:
    option_parsing.output_folder(options.out)
    path = options.source
    own = run_folder(path) is not None and (path.is_dir() or path.name in WHOLE)
    stored = own or (path.is_dir() and not holds_sequences(path))
    jobs = _of_runs(options, own) if stored else _of_sequences(options)
    for folder, *_ in jobs:
        if is_run(folder) or is_sequence(folder):
            raise InputError(
                file=folder, place="--out", got="a folder of tracks or of a sequence", expected="another folder",
                remedy="choose another --out",
            )  # fmt: skip
    rows, lines = [], []
    with ProgressMeter("export", len(jobs)) as meter:
        for folder, facts, make in jobs:
            tables = make(places)
            files = write_tables(tables, folder, form, facts)
            sizes = {name: len(table.to_arrow()) for name, table in vars(tables).items()}
            rows.append({**facts, "folder": folder, "files": files, "rows": sizes})
            people, groups, events = (sizes[name] for name in ("people_summary", "groups", "events"))
            lines.append(f"{folder}: people {people}, groups {groups}, events {events}")
            meter.step(facts["sequence"])
    return CommandResult({"tables": rows}, "\n".join(lines))


Job = tuple[Path, dict[str, Any], Callable[[Places], TidyTables]]


def _of_runs(options: TrajnetOptions, own: bool) -> list[Job]:
    found = find_tracks(options.source)
    folders = [options.out] * own or output_paths(options.out, [str(s.name) for s in found], source=options.source)
    jobs: list[Job] = []
    for stored, target in zip(found, folders, strict=True):
        folder = stored.path if stored.path.is_dir() else stored.path.parent
        stored.check()
        if not stored.info:
            raise InputError(
                file=stored.path, got="tracks of another program", expected="what `flockscope track` or `group` wrote",
                remedy="give the text itself",
            )  # fmt: skip
        if "fps" in stored.info:
            refuse_options(vars(options), "fps", folder, "a run", "run.json states it")
        fps = frame_rate(options.fps, stored.info.get("fps"))
        facts = {"sequence": stored.info.get("sequence", folder.name), "fps": fps}
        jobs.append((target, facts, partial(_run, stored, fps)))
    return jobs


def _run(stored: StoredTracks, fps: float, places: Places) -> TidyTables:
    return run_tables(read_checked_tracks(stored.path), fps, places)


def _of_sequences(options: TrajnetOptions) -> list[Job]:
    sequences = open_source(options.source, fps=options.fps, images=False)
    for sequence in sequences:
        if sequence.load_truth is None:
            raise InputError(
                file=sequence.source.get("path", options.source), got="no labelled people",
                expected="a run, or people with ids", remedy="`flockscope track` it, and give the --out of that",
            )  # fmt: skip
    folders = run_folders(sequences, options.source, options.out)
    facts = [{"sequence": s.name, "fps": s.fps} for s in sequences]
    return [(f, about, partial(_truth, s)) for f, about, s in zip(folders, facts, sequences, strict=True)]


def _truth(sequence: Sequence, places: Places) -> TidyTables:
    assert sequence.truth is not None
    return truth_tables(sequence.truth, places)
