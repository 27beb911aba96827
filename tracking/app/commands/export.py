"""`flockscope export`: datasets as COCO, YOLO, KITTI, MOTS and webdataset; people as tables and texts.

The formats themselves are in tracking.export.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from scenarios.errors import InputError, counted, reject
from sim.store.seal import reject_sealed
from sim.types import Sequence
from tracking.app.command_options import (
    CocoOptions,
    CsvOptions,
    KittiOptions,
    MotsOptions,
    TrajnetOptions,
    WebdatasetOptions,
    YoloOptions,
)
from tracking.app.command_result import CommandResult
from tracking.app.progress import ProgressMeter
from tracking.app.sequence_workers import source_of
from tracking.app.stored_tracks import STATED, StoredTracks, find_tracks, holds_tracks, run_folders
from tracking.export.places import Places, parse_places
from tracking.export.table_options import seconds_of
from tracking.export.tidy_tables import Form, TidyTables, run_tables, truth_tables, write_tables
from tracking.recordings.options import refuse_options
from tracking.recordings.track_texts import read_checked_tracks


def export_coco(options: CocoOptions) -> CommandResult:
    """Writes a COCO file of all sequences with labelled boxes at the path of the options."""
    from sim.store.own_files import output_file
    from tracking.export.coco import coco

    path = output_file(options.out, ".json")
    made = coco(
        options.folder, path, person_class=options.person_class, min_visibility=options.min_visibility,
        part_size=options.part_size,
    )  # fmt: skip
    root = options.folder if options.folder.is_dir() else options.folder.parent
    shown = str(path) if options.part_size is None else f"{counted(len(made.files), 'part')}, {made.files[0]} and so on"
    lines = [shown, made.text, f"file names are relative to {root}"]
    facts = {"file": made.files[0], "files": made.files, "root": root, **made.counts}
    return CommandResult(facts, "\n".join(lines))


def export_yolo(options: YoloOptions) -> CommandResult:
    """Writes pictures, labels and data.yaml of all sequences with pictures and labelled boxes into a new folder."""
    from tracking.export.yolo import yolo

    made = yolo(options.folder, options.out, person_class=options.person_class, min_visibility=options.min_visibility)
    return CommandResult({"folder": made.path, **made.counts}, f"{made.path}\n{made.text}")


def export_kitti(options: KittiOptions) -> CommandResult:
    """Writes pictures, disparities, calibrations and labels of a generated dataset into the folder --out."""
    from tracking.export.kitti import kitti
    from tracking.export.kitti_labels import kitti_labels

    folders = kitti(options.folder, options.out)
    made = kitti_labels(options.folder, options.out, min_visibility=options.min_visibility)
    return CommandResult({"folders": folders, **made.counts}, "\n".join([*map(str, folders), made.text]))


def export_mots(options: MotsOptions) -> CommandResult:
    """Writes pictures and masks of all sequences of a generated dataset into a new folder."""
    from tracking.export.mots import mots

    made = mots(options.folder, options.out, min_visibility=options.min_visibility)
    return CommandResult({"folder": made.path, **made.counts}, f"{made.path}\n{made.text}")


def export_webdataset(options: WebdatasetOptions) -> CommandResult:
    """Writes tar shards of all sequences of a generated dataset into the folder of --out, and an index.json."""
    from tracking.export.frame_shards import frame_shards
    from tracking.export.webdataset import size_of, webdataset

    out, size = options.out, size_of(options.shard_size)
    of_frames = {name: getattr(options, name) for name in ("seed", "min_visibility")}
    of_frames = {name: value for name, value in of_frames.items() if value is not None}
    counts: dict[str, Any] = {}
    with ProgressMeter("export") as meter:
        if options.sample == "frame":
            made, index = frame_shards(options.folder, out, shard_size=size, progress=meter.update, **of_frames)
            counts, what = made.counts, made.text
        else:
            for name in of_frames:
                flag = f"--{name.replace('_', '-')}"
                reject(True, "", "--sample sequence", "--sample frame", f"leave out {flag}, or add it", flag)
            index = webdataset(options.folder, out, shard_size=size, progress=meter.update)
            what = counted(sum(len(s["sequences"]) for s in index["shards"]), "sequence")
    shards = index["shards"]
    total = sum(s["bytes"] for s in shards)
    text = f"{what} in {counted(len(shards), 'shard')}, {total / 1e6:.1f} MB; content {index['content_hash'][:16]}"
    facts = {"shards": [out / s["name"] for s in shards], "bytes": total, "content_hash": index["content_hash"]}
    return CommandResult(facts | counts, text)


def export(form: Form, options: TrajnetOptions) -> CommandResult:
    """Writes the tables of every run or sequence, or their people, in this form."""
    places: Places = {}
    chosen: dict[str, Any] = {}
    if isinstance(options, CsvOptions):
        places, chosen = parse_places(options.line, options.zone), _table_options(options)
    jobs = _of_runs(options) if holds_tracks(options.source) else _of_sequences(options)
    folders = run_folders([sequence for sequence, _ in jobs], options.source, options.out)
    for folder in folders:
        reject_sealed(folder)
    rows, lines = [], []
    with ProgressMeter("export", len(jobs)) as meter:
        for (sequence, stored), folder in zip(jobs, folders, strict=True):
            tables, facts = _tables(sequence, stored, places, chosen), {"sequence": sequence.name, "fps": sequence.fps}
            files = write_tables(tables, folder, form, facts)
            sizes = {name: len(table.to_arrow()) for name, table in tables.named().items()}
            left_out = tables.left_out
            rows.append({**facts, "folder": folder, "files": files, "rows": sizes, "left_out": vars(left_out)})
            people, groups, events = (sizes[name] for name in ("people_summary", "groups", "events"))
            lines.append(f"{folder}: people {people}, groups {groups}, events {events}")
            lines += [left_out.text()] * bool(left_out.seconds)
            meter.step(sequence.name)
    return CommandResult({"tables": rows}, "\n".join(lines))


export_csv, export_parquet = partial(export, "csv"), partial(export, "parquet")
export_trajnet, export_pedpy = partial(export, "trajnet"), partial(export, "pedpy")
Job = tuple[Sequence, StoredTracks | None]  # a sequence, or what stands for it, and the run whose tables are made


def _of_runs(options: TrajnetOptions) -> list[Job]:
    found = find_tracks(options.source)
    for stored in found:
        stored.check()
        refuse_options(vars(options), "px_per_m person_class", stored.folder, "a run", STATED)
        if not stored.info:
            got, expected = "tracks of another program", "what `flockscope track` or `group` wrote"
            raise InputError(file=stored.path, got=got, expected=expected, remedy="give the text itself")
    return [(stored.sequence(options.fps), stored) for stored in found]


def _of_sequences(options: TrajnetOptions) -> list[Job]:
    sequences = source_of(options, options.source).open()
    for sequence in sequences:
        if sequence.load_truth is None:
            file, expected = sequence.source.get("path", options.source), "a run, or people with ids"
            remedy = "`flockscope track` it, and give the --out of that"
            raise InputError(file=file, got="no labelled people", expected=expected, remedy=remedy)
    return [(sequence, None) for sequence in sequences]


def _table_options(options: CsvOptions) -> dict[str, Any]:
    """Returns the options of the tables, with times in s."""
    got, expected, remedy = "--margin alone", "--line or --zone, where it counts", "add one, or leave it out"
    reject(options.margin is not None and not (options.line or options.zone), "", got, expected, remedy, "--margin")
    end = None if options.end is None else seconds_of(options.end, "--end")
    times = {name: getattr(options, name) for name in ("every", "start", "min_duration")}
    seconds = {name: seconds_of(text, f"--{name.replace('_', '-')}") for name, text in times.items()}
    return {"margin": options.margin, "end": end, **seconds}


def _tables(sequence: Sequence, stored: StoredTracks | None, places: Places, options: Mapping[str, Any]) -> TidyTables:
    if stored is not None:
        tracks = read_checked_tracks(stored.path)
        lost = stored.info.get("unobserved") or ()
        return run_tables(tracks, sequence.fps, places, px_per_m=sequence.px_per_m, unobserved=lost, **options)
    assert sequence.truth is not None
    return truth_tables(sequence.truth, places, **options)
