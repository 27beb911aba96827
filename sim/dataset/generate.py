"""Generate a dataset: simulate every entry with every seed on any number of workers, and store the sequences.

A sequence folder appears complete or not at all, so an interrupted command can be run again: stored sequences are kept.
The stored bytes depend on scenario, seed and versions only, not on the workers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TypedDict, Unpack
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, OrderError, WorkError
from scenarios.loading.resolve import Entry
from sim.clock import check_stride
from sim.dataset.sequence_job import SequenceJob, lost_job, plan_jobs, run_job, stored_manifest
from sim.dataset.splits import split_of
from sim.io.files.atomic import PARTIAL, remove_partials, write_file
from sim.io.files.lock import lock_folder
from sim.io.store.manifest import MANIFEST
from sim.io.store.streams import check_streams
from sim.workers.start import WorkerOptions, start_workers

LEFT_OUT = 0.05
"""Greatest share of sequences that may be left out because an order of their script did not come true."""
QUEUED_JOBS = 100  # jobs that wait at a cluster's scheduler, beside one for each worker
ONE_WORKER = WorkerOptions()
Progress = Callable[[int, int, str], None]
"""Called as progress(sequences done, sequences in all, name of the last one)."""


class Stored(TypedDict, total=False):
    """What is stored of each sequence.

    streams: pictures ("left", "right", "disparity", "ids", "background"; () for none). images: their file type, "jpg",
    "png" or "mp4". stride: N stores every N-th frame of the camera only: 1, 1 + N, …, as they are without it, and
    numbered from 1.
    """

    streams: Iterable[str]
    images: str
    stride: int


class Folders(list[Path]):
    """The folders of the sequences made. left_out: by name, the error of each sequence whose script did not come
    true."""

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
    """Write OUT/flockscope-<split>/<name>-s<seed>/ for every entry and seed, and OUT/seqmaps; returns the sequence
    folders.

    The folders come in the order of entries, all seeds of an entry together; no entries give []. Stored sequences of
    the same scenario, seed, version and pictures are kept if all their files are intact, else made again.

    entries: resolved entries, or names of scenarios, suites or TOML files. set: "key=value" settings for entries given
    by name. seeds: inside one split (train from 0, val from 10,000, test from 20,000, fit from 30,000, demo from
    40,000). workers: by default this process. The workers of a cluster must share the folder `out` under the same path.
    progress: called as progress(sequences done, sequences in all, name of the last one) after each, failed ones
    included. stored: streams, images, stride (`Stored`); left jpg pictures of all frames by default.

    A sequence is left out if an order of its script did not come true; the result's `left_out` holds the reasons. If
    that happens to more than 5 % of the sequences, it is an error.

    Raises InputError before anything is simulated if an option or scenario is wrong, two entries share a name, a folder
    holds another sequence, or another process writes to `out`. If sequences fail, the others are made, and then an
    error is raised with the text of the first failure and the number of failures: InputError if all failures are
    InputErrors, else WorkError. It is a WorkError, too, if a sequence that a worker made is not found here. An error
    that would hit every sequence, as a full disk, ends the work at once. Also raises as `start_workers`: InputError for
    a wrong address of a cluster, WorkError if the cluster does not answer or workers are lost.
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
    """Return the jobs with what they store (`Stored`). Raises InputError for wrong values."""
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
    """Run all jobs, or those up to the first fatal error; returns the errors by sequence name, in the order of the
    jobs.

    workers: which workers to use, never more than jobs. done: called with each finished job, also a failed one, but not
    with the job of the fatal error. Jobs without error have no entry. Raises as `start_workers`: InputError for a wrong
    address of a cluster, WorkError if it does not answer. Raises WorkError if the workers are lost, and InputError or
    WorkError if the marker file that a cluster needs cannot be written.
    """
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
    """Write an empty marker file into OUT and return the jobs with that file as their `marker`; needs at least one job.

    OUT is the folder above that of the jobs' split. A worker starts such a job only if it sees the file, so that it
    writes to the same file system. remove_partials deletes the file. Raises InputError if it cannot be written,
    WorkError if the disk is full, IndexError without jobs.
    """
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
    """Write ROOT/seqmaps/flockscope-<split>.txt, TrackEval's list of sequences; returns the names in it.

    After a first line "name" it lists, sorted, every folder below ROOT/flockscope-<split> that has a manifest.json;
    folders whose names begin with a dot are left out. The manifests are not read. Without such a folder no file is
    written and the result is empty; an existing file stays. Raises InputError if the file cannot be written, WorkError
    if the disk is full.
    """
    folder = root / f"flockscope-{split}"
    complete = sorted(p.parent.name for p in folder.glob(f"*/{MANIFEST}") if not p.parent.name.startswith("."))
    if complete:
        write_file(root / "seqmaps" / f"flockscope-{split}.txt", "\n".join(["name", *complete, ""]).encode())
    return {*complete}


def _summary(errors: dict[str, FlockscopeError], total: int) -> FlockscopeError:
    """Return one error for all failures of `total` jobs, given by sequence name; `errors` has at least one entry.

    A single error is returned unchanged. Otherwise the result has the text of the first error, the number of further
    errors and up to five of their names. Its type is that of the errors if all have the same, else WorkError.
    """
    first, *_ = errors.values()
    if len(errors) == 1:
        return first
    others = ", ".join(list(errors)[1:6]) + (", …" if len(errors) > 6 else "")
    kind = type(first) if len({type(e) for e in errors.values()}) == 1 else WorkError
    return kind(
        file=first.file, place=first.place, got=f"{first.got} (and {len(errors) - 1} more of {total}: {others})",
        expected=first.expected, remedy=first.remedy + ("" if len(errors) == total else "; the others are kept"),
    )  # fmt: skip
