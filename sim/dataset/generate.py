"""Datasets: simulates every entry, or replays every recording, with every seed, and stores the sequences.

A sequence folder appears complete or not at all, so an interrupted command can be run again: stored sequences are kept.
The stored bytes depend on scenario, seed and versions only, not on the workers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict, Unpack, cast
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, OrderError, WorkError
from scenarios.loading.resolve import Entry
from scenarios.loading.toml_files import dump
from scenarios.schema.scenario import ObservationSpec
from sim.clock import check_stride
from sim.dataset.replay import WHOLE, Cut, replay_name, resolve_replay
from sim.dataset.sequence_job import SequenceJob, is_stored, lost_job, plan_jobs, run_job, stored_manifest
from sim.dataset.splits import TUNING_SPLITS, is_real, split_of
from sim.io.files.atomic import PARTIAL, lock_folder, remove_partials, write_file
from sim.io.files.output_paths import output_path, output_paths
from sim.io.store import sequence_folder
from sim.io.store.seal import MANIFEST
from sim.io.store.streams import check_streams
from sim.types import Camera, Sequence
from sim.workers.start import WorkerOptions, start_workers

LEFT_OUT = 0.05  # greatest share of sequences that may be left out because an order of their script did not come true
QUEUED_JOBS = 100  # jobs that wait at a cluster's scheduler, beside one for each worker
ONE_WORKER = WorkerOptions()
Progress = Callable[[int, int, str], None]  # called as progress(sequences done, sequences in all, name of the last one)


class Stored(TypedDict, total=False):
    """What is stored of each sequence: pictures ("left", "right", "disparity", "ids"), file type, every N-th frame."""

    streams: Iterable[str]  # pictures ("left", "right", "disparity", "ids", "background"; () for none)
    images: str  # their file type, "jpg", "png" or "mp4"
    # N stores every N-th frame of the camera only: 1, 1 + N, …, as they are without it, and numbered from 1
    stride: int


class Folders(list[Path]):
    """The folders of the sequences made; `left_out` has the error of each whose script did not come true, by name."""

    def __init__(self, folders: Iterable[Path], left_out: dict[str, OrderError]) -> None:
        super().__init__(folders)
        self.left_out = left_out


def generate(
    entries: Iterable[Entry | str],
    seeds: range,
    out: str | Path,
    *,
    set: Iterable[str] = (),
    workers: WorkerOptions = ONE_WORKER,
    progress: Progress | None = None,
    **stored: Unpack[Stored],
) -> Folders:
    """Simulates every entry with every seed, and stores each sequence as OUT/flockscope-<split>/<name>-s<seed>/.

    Stored sequences of the same scenario, seed, version and pictures are kept if all their files are intact. The lists
    in OUT/seqmaps are for TrackEval.

    Args:
        entries: Resolved entries, or names of scenarios, suites or TOML files.
        seeds: Inside one split: train from 0, val from 10,000, test from 20,000, fit from 30,000, demo from 40,000.
        out: The folder of the dataset.
        set: "key=value" settings for entries given by name.
        workers: By default this process. Those of a cluster must share the folder `out` under the same path.
        progress: Called as progress(sequences done, sequences in all, name of the last one) after each.
        **stored: Streams, images, stride (`Stored`); left jpg pictures of all frames by default.

    Returns:
        The folders, in the order of entries, all seeds of an entry together. `left_out` has the errors of those whose
        script did not come true.

    Raises:
        InputError: An argument is wrong, a folder holds another sequence, or all failures are InputErrors.
        WorkError: Sequences failed, more than 5 % were left out, or workers were lost. The other sequences are made.
    """
    if workers.count < 1:
        raise InputError(place="workers", got=workers.count, expected="1 or more", remedy="correct --workers")
    split, root = split_of(seeds), Path(out) if workers.cluster is None else Path(out).absolute()
    folder = root / f"flockscope-{split}"
    jobs = _storing(plan_jobs(_resolved(entries, set), seeds, folder), **stored)
    with lock_folder(root):
        remove_partials(root, folder, root / "seqmaps")
        for job in jobs:
            stored_manifest(job)
        try:
            errors = _run_jobs(jobs, workers, _counter(progress, len(jobs)))
        finally:
            remove_partials(root, folder)
        try:
            complete = write_seqmap(root, split)
        except FlockscopeError as error:
            errors["seqmaps"] = error
    unfulfilled = {name: error for name, error in errors.items() if isinstance(error, OrderError)}
    if len(unfulfilled) <= LEFT_OUT * len(jobs):
        errors = {name: error for name, error in errors.items() if name not in unfulfilled}
    else:
        unfulfilled = {}
    made = [job for job in jobs if job.name not in unfulfilled]
    errors = errors or {job.name: _not_visible(job) for job in made if job.name not in complete}
    if errors:
        raise _summary(errors, len(jobs))
    return Folders((job.folder for job in made), unfulfilled)


def _storing(
    jobs: list[SequenceJob], streams: Iterable[str] = ("left",), images: str = "jpg", stride: int = 1
) -> list[SequenceJob]:
    pictures = check_streams(streams, images)
    for job in jobs:
        check_stride(stride, job.entry.scenario.camera.fps)
    return [replace(job, streams=pictures, images=images, stride=stride) for job in jobs]


def _resolved(entries: Iterable[Entry | str], set: Iterable[str]) -> list[Entry]:
    from scenarios.loading.resolve import resolve

    settings = tuple(set)
    return [e for entry in entries for e in (resolve(entry, settings) if isinstance(entry, str) else [entry])]


def _run_jobs(
    jobs: list[SequenceJob], workers: WorkerOptions, done: Callable[[SequenceJob], None]
) -> dict[str, FlockscopeError]:
    errors: dict[str, FlockscopeError] = {}
    with start_workers(min(workers.count, max(1, len(jobs))), workers.cluster) as run:
        marked = _with_marker(jobs) if jobs and workers.cluster is not None else jobs
        for job, outcome in run(run_job, marked, ahead=QUEUED_JOBS, on_loss=lost_job):
            if outcome.error is not None:
                errors[job.name] = outcome.error
            if outcome.fatal:
                break
            done(job)
    return {job.name: errors[job.name] for job in jobs if job.name in errors}


def _with_marker(jobs: list[SequenceJob]) -> list[SequenceJob]:
    # A worker starts a job only if it sees this file: else it would write to another file system.
    marker = jobs[0].folder.parents[1] / f"{PARTIAL}{uuid4().hex}"
    write_file(marker, b"")
    return [replace(job, marker=marker) for job in jobs]


def _counter(progress: Progress | None, total: int) -> Callable[[SequenceJob], None]:
    count = 0

    def done(job: SequenceJob) -> None:
        nonlocal count
        count += 1
        if progress is not None:
            progress(count, total, job.name)

    return done


def _not_visible(job: SequenceJob) -> WorkError:
    return WorkError(
        file=job.folder, got="nothing, though a worker has made it", expected="a folder that all machines share",
        remedy="run again, or choose another --out",
    )  # fmt: skip


def write_seqmap(root: Path, split: str) -> set[str]:
    """Writes ROOT/seqmaps/flockscope-<split>.txt, TrackEval's list of complete sequences; returns their names."""
    folder = root / f"flockscope-{split}"
    complete = sorted(p.parent.name for p in folder.glob(f"*/{MANIFEST}") if not p.parent.name.startswith("."))
    if complete:
        write_file(root / "seqmaps" / f"flockscope-{split}.txt", "\n".join(["name", *complete, ""]).encode())
    return {*complete}


def _summary(errors: dict[str, FlockscopeError], total: int) -> FlockscopeError:
    first, *_ = errors.values()
    if len(errors) == 1:
        return first
    others = ", ".join(list(errors)[1:6]) + (", …" if len(errors) > 6 else "")
    # One text for all failures: that of the first, and the names of some others.
    kind = type(first) if len({type(e) for e in errors.values()}) == 1 else WorkError
    return kind(
        file=first.file, place=first.place, got=f"{first.got} (and {len(errors) - 1} more of {total}: {others})",
        expected=first.expected, remedy=first.remedy + ("" if len(errors) == total else "; the others are kept"),
    )  # fmt: skip


@dataclass(frozen=True)
class ReplayOptions:
    """Options that all replays of a dataset share."""

    view: ObservationSpec  # camera, sensor, light and picture, with the frame rate
    cut: Cut = WHOLE  # the part of each recording to replay, default all
    # camera, or its file, of recordings that have boxes but no ground positions; None if not needed; an error for
    # others
    calibration: Camera | str | Path | None = None
    # pictures to store, some of "left", "right", "disparity", "ids", "background"; () for none
    streams: tuple[str, ...] = ("left",)
    images: str = "jpg"  # their file type, "jpg", "png" or "mp4"


def store_replays(
    sources: Iterable[Sequence], options: ReplayOptions, seeds: range, out: str | Path, progress: Progress | None = None
) -> list[Path]:
    """Stores a replay of every source with every seed, as `generate` does; returns the folders.

    The first error ends the work; replays stored before it are kept. Recordings of real motion need seeds from 20,000
    on.
    """
    recordings, split, root = list(sources), split_of(seeds), Path(out)
    folder = root / f"flockscope-{split}"
    _check(recordings, folder, options.cut, seeds, split)
    options = replace(options, streams=tuple(check_streams(options.streams, options.images)))
    made: list[Path] = []
    with lock_folder(root):
        remove_partials(root, folder, root / "seqmaps")
        try:
            for recording in recordings:
                for seed in seeds:
                    made.append(_store(recording, options, seed, folder))
                    if progress is not None:
                        progress(len(made), len(recordings) * len(seeds), made[-1].name)
        finally:
            remove_partials(root, folder)
            write_seqmap(root, split)
    return made


def _check(recordings: list[Sequence], folder: Path, cut: Cut, seeds: range, split: str) -> None:
    output_paths(folder, [replay_name(recording.name, cut) for recording in recordings], source="recordings")
    if split in TUNING_SPLITS and any(is_real(recording) for recording in recordings):
        raise InputError(
            place="--seeds", got=f"{seeds.start} ({split})", expected="seeds from 20000 (test) on, for real motion",
            remedy="choose other seeds: nothing is tuned on recordings",
        )  # fmt: skip


def _store(recording: Sequence, options: ReplayOptions, seed: int, folder: Path) -> Path:
    sequence, form = resolve_replay(
        recording, options.view, seed, cut=options.cut, calibration=options.calibration, streams=options.streams
    )  # fmt: skip
    entry = Entry(form.name, cast(Any, form))
    job = SequenceJob(output_path(folder, form.name, f"-s{seed:05d}"), entry, seed, options.streams, options.images)
    if not is_stored(job):
        sequence_folder.write_sequence(
            job.folder, replace(sequence, name=job.name), scenario=dump(form), seed=seed, streams=options.streams,
            images=options.images, keep=lambda: is_stored(job),
        )  # fmt: skip
    return job.folder
