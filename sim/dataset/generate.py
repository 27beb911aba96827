"""Datasets: simulates every entry, or replays every recording, with every seed, and stores the sequences.

A sequence folder appears complete or not at all, so an interrupted command can be run again: stored sequences are kept.
The stored bytes depend on scenario, seed and versions only, not on the workers.
"""

from __future__ import annotations

import shutil
import socket
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from itertools import groupby, product
from pathlib import Path
from typing import Any, TypeVar, cast
from uuid import uuid4

from scenarios.errors import FlockscopeError, InputError, OrderError, WorkError, reject
from scenarios.loading.resolve import Entry, resolve
from scenarios.loading.toml_files import dump
from scenarios.schema.scenario import ObservationSpec
from sim.clock import check_stride
from sim.dataset.replay import WHOLE, Cut, replay_name, resolve_replay
from sim.dataset.splits import TUNING_SPLITS, is_real, split_of
from sim.draws import drawn
from sim.store import packs, sequence_folder
from sim.store.atomic import PARTIAL, lock_folder, remove_partials, write_file
from sim.store.group_files import stands_in, warn_of
from sim.store.own_files import is_side_file, output_path, output_paths
from sim.store.seal import MANIFEST, SHARDS, damaged_files, identity, is_own_sequence, read_manifest, reject_runs
from sim.streams import check_streams
from sim.types import Camera, Sequence
from sim.workers.start import WorkerOptions, start_workers

SPLIT = "flockscope-"  # begins the name of a split's folder
SHARED_DELAY = 5.0  # s that a shared file system may take to show one machine the file of another


@dataclass(frozen=True)
class SequenceJob:
    """One sequence to make."""

    folder: Path  # where it is stored; its last part is the sequence's name
    entry: Entry  # the scenario to simulate
    seed: int  # the random seed
    # pictures to store, some of "left", "right", "disparity", "ids", "background"; () for none
    streams: tuple[str, ...] = ()
    images: str = "jpg"  # their file type, "jpg", "png" or "mp4"
    stride: int = 1  # N stores every N-th frame of the camera
    # a file that a worker must see before it starts, because it would otherwise write to another file system; None for
    # local workers
    marker: Path | None = None

    @property
    def name(self) -> str:
        """The sequence's name, the last part of `folder`: <entry>-s<seed, 5 digits>."""
        return self.folder.name


@dataclass(frozen=True)
class ShardJob:
    """One shard to make: sequences of one entry."""

    path: Path  # of the shard: OUT/flockscope-<split>/<entry>/<entry>-s<first seed of its hundred>.tar
    entry: Entry  # the scenario to simulate, not drawn yet
    seeds: tuple[int, ...]  # all within one hundred
    streams: tuple[str, ...] = ()  # as of SequenceJob, and so are the others
    images: str = "jpg"
    stride: int = 1
    marker: Path | None = None

    @property
    def name(self) -> str:
        """The name of the shard, without `.tar`."""
        return self.path.stem

    @property
    def facts(self) -> dict[str, Any]:
        """What is equal for all seeds: the identity of the entry's scenario, and what is stored of it."""
        same = identity(dump(self.entry.scenario), 0, self.entry.repeat, self.streams, self.images)
        return {key: value for key, value in same.items() if key != "seed"} | {"stride": self.stride}

    def job(self, folder: Path, seed: int) -> SequenceJob:
        """Returns the job that stores the sequence of one seed in `folder`."""
        entry = replace(self.entry, scenario=drawn(self.entry.scenario, seed, self.entry.repeat))
        path = output_path(folder, entry.name, f"-s{seed:05d}")
        return SequenceJob(path, entry, seed, self.streams, self.images, self.stride)


@dataclass(frozen=True)
class JobOutcome:
    """How a job ended."""

    error: FlockscopeError | None = None  # the error, None if the sequence or shard is stored
    fatal: bool = False  # True if every other job would fail in the same way, as with a full disk
    # the error of each sequence that is not in the shard because an order of its script did not come true, by name
    left_out: Mapping[str, OrderError] = field(default_factory=dict)


def stored_manifest(job: SequenceJob) -> dict[str, Any] | None:
    """Returns the manifest in the job's folder; None if there is no folder, or no manifest in it.

    Raises InputError if the folder holds another sequence, or files that flockscope did not write.
    """
    folder = job.folder
    if not folder.exists():
        return None
    inside = [path for path in folder.iterdir() if not is_side_file(path.name)] if folder.is_dir() else [folder]
    if inside and not is_own_sequence(folder):
        got, expected = "something that flockscope did not write", "a stored sequence, or nothing"
        raise InputError(file=folder, got=got, expected=expected, remedy="choose another --out, or move it away")
    if not (folder / MANIFEST).exists():
        return None
    try:
        manifest = read_manifest(folder)
    except InputError as error:
        # An invalid manifest does not tell what the folder holds.
        raise error.replaced(remedy="delete that folder, or choose another --out") from None
    scenario = dump(job.entry.scenario)
    wanted = {**identity(scenario, job.seed, job.entry.repeat, job.streams, job.images), "stride": job.stride}
    stored = {"stride": 1} | manifest
    other = [key for key in wanted if stored.get(key) != wanted[key]]
    if other:
        short = ({**values, "scenario_hash": values["scenario_hash"][:8]} for values in (stored, wanted))
        got, expected = (", ".join(f"{k.removesuffix('_hash')} {values.get(k)}" for k in other) for values in short)
        remedy = "choose another --out, or delete that folder"
        raise InputError(file=folder, got=f"a sequence of {got}", expected=expected, remedy=remedy)
    return manifest


def is_stored(job: SequenceJob) -> bool:
    """Returns True if the job's folder holds its sequence and each file has the hash that the manifest states.

    Raises InputError if the folder holds something else.
    """
    manifest = stored_manifest(job)
    return manifest is not None and next(damaged_files(job.folder, manifest["files"]), None) is None


def store(job: SequenceJob, sequence: Sequence) -> None:
    """Writes `sequence` into the job's folder, unless the folder holds it already, undamaged."""
    if not is_stored(job):
        sequence_folder.write_sequence(
            job.folder, replace(sequence, name=job.name), scenario=dump(job.entry.scenario), seed=job.seed,
            repeat=job.entry.repeat, streams=job.streams, images=job.images, background=False,
            keep=lambda: is_stored(job),
        )  # fmt: skip


def simulate_and_store(job: SequenceJob) -> None:
    """Simulates the job's scenario and writes its folder, which replaces a damaged one; raises FlockscopeError."""
    from sim.sequence import simulate

    entry = job.entry
    try:
        store(job, simulate(entry.scenario, job.seed, entry.repeat, job.streams, job.stride))
    except FlockscopeError as error:
        # A full disk: it would hit every other job, too.
        if isinstance(error.__cause__, OSError):
            raise
        raise error.replaced(file=entry.file or error.file or job.name) from error
    except Exception as error:
        got, remedy = f"{type(error).__name__}: {error}", "report it with the scenario and seed"
        raise WorkError(file=job.name, got=got, expected="a sequence", remedy=remedy) from error


def run_job(job: SequenceJob) -> JobOutcome:
    """Makes the job's sequence unless it is stored undamaged; a FlockscopeError is in the outcome, not raised."""
    try:
        if job.marker is not None:
            _wait_for(job.marker)
        if not is_stored(job):
            simulate_and_store(job)
    except FlockscopeError as error:
        fatal = isinstance(error.__cause__, OSError)
        if fatal and job.marker is not None:
            error = error.replaced(place=f"on {socket.gethostname()}")
        return JobOutcome(error, fatal)
    return JobOutcome()


def stored_shard(job: ShardJob) -> tuple[set[int], dict[str, OrderError]] | None:
    """Returns the seeds that a stored shard has, and its sequences that were left out; None without a sealed shard.

    Raises InputError if the shard is of another scenario, version or pictures.
    """
    if not packs.is_shard(job.path):
        return None
    facts, wanted = packs.read_seal(job.path).facts, job.facts
    if other := [key for key in wanted if facts.get(key) != wanted[key]]:
        got, expected = (", ".join(f"{k} {str(some.get(k))[:8]}" for k in other) for some in (facts, wanted))
        remedy = "choose another --out, or delete that shard"
        raise InputError(file=job.path, got=f"sequences of {got}", expected=expected, remedy=remedy)
    return set(facts["seeds"]), {name: OrderError(**parts) for name, parts in facts["left_out"].items()}


def run_shard(job: ShardJob) -> JobOutcome:
    """Makes a shard unless it is stored undamaged with all seeds of the job; stored seeds of its hundred stay in it.

    A FlockscopeError is in the outcome, not raised; a shard with another error than an OrderError is not written.
    """
    left_out: dict[str, OrderError] = {}
    try:
        if job.marker is not None:
            _wait_for(job.marker)
        stored = stored_shard(job)
        if stored is not None and stored[0].issuperset(job.seeds):
            with suppress(InputError):  # damaged: it is made anew
                packs.check_shard(job.path)
                return JobOutcome(left_out=_wanted(job, stored[1]))
        seeds = sorted({*job.seeds, *(stored[0] if stored else ())})
        facts = {**job.facts, "seeds": seeds, "left_out": {}, "stands": {}}
        with packs.new_shard(job.path, job.path.parents[1].name.removeprefix(SPLIT), facts) as (shard, folder):
            for one in (job.job(folder, seed) for seed in seeds):
                try:
                    simulate_and_store(one)
                except OrderError as error:
                    left_out[one.name] = error
                    facts["left_out"][one.name] = error.as_dict()
                    continue
                if stands := stands_in(one.folder):
                    facts["stands"][one.name] = stands
                shard.add(one.folder)
                shutil.rmtree(one.folder)
    except FlockscopeError as error:
        fatal = isinstance(error.__cause__, OSError)
        return JobOutcome(error, fatal)
    return JobOutcome(left_out=_wanted(job, left_out))


def _wanted(job: ShardJob, left_out: dict[str, OrderError]) -> dict[str, OrderError]:
    """Returns the sequences of the job's own seeds: a stored shard can have more."""
    return {name: error for name, error in left_out.items() if int(name.rpartition("-s")[2]) in job.seeds}


def lost_job(job: SequenceJob | ShardJob, error: WorkError) -> JobOutcome:
    """Returns the outcome of a job that killed too many workers: `error` with the job's name as its file."""
    return JobOutcome(error.replaced(file=job.name))


def _wait_for(marker: Path) -> None:
    for _ in range(20):
        if marker.exists():
            return
        time.sleep(SHARED_DELAY / 20)
    raise InputError(
        file=marker.parent, got="another folder, or none", expected="the one that the command writes to",
        remedy="choose an --out that all machines share under the same path",
    ) from FileNotFoundError(marker)  # fmt: skip


LEFT_OUT = 0.05  # greatest share of sequences that may be left out because an order of their script did not come true
QUEUED_JOBS = 100  # jobs that wait at a cluster's scheduler, beside one for each worker
ONE_WORKER = WorkerOptions()
J = TypeVar("J", SequenceJob, ShardJob)
Progress = Callable[[int, int, str], None]  # called as progress(sequences done, sequences in all, name of the last one)


class Folders(list[Path]):
    """The list of the folders of the sequences made.

    left_out: the error of each sequence that was left out because an order of its script did not come true, by name.
    """

    def __init__(self, folders: Iterable[Path] = (), left_out: dict[str, OrderError] | None = None) -> None:
        super().__init__(folders)
        self.left_out = left_out or {}


def generate(
    entries: Iterable[Entry | str], seeds: range, out: str | Path, *, set: Iterable[str] = (),
    workers: WorkerOptions = ONE_WORKER, progress: Progress | None = None, streams: Iterable[str] = ("left",),
    images: str = "jpg", background: bool = True, stride: int = 1, pack: bool = False,
) -> Folders:  # fmt: skip
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
        streams: Pictures to store: some of "left", "right", "disparity", "ids", "background"; () for none.
        images: Their file type, "jpg", "png" or "mp4".
        background: True adds "background" to "left" and "right".
        stride: N stores every N-th frame of the camera only: 1, 1 + N, …, numbered from 1.
        pack: True stores shards in place of folders, of up to 100 sequences each (`sim.store.packs`). A shard is
            made whole or not at all.

    Returns:
        The folders, or the shards, in the order of entries, all seeds of an entry together. `left_out` has the errors
        of sequences left out because an order of their script did not come true.

    Raises:
        InputError: An argument is wrong, a folder holds another sequence, or all failures are InputErrors.
        WorkError: Sequences failed, more than 5 % were left out, or workers were lost. The other sequences are made.
    """
    split, root = split_of(seeds), Path(out) if workers.cluster is None else Path(out).absolute()
    folder = root / f"{SPLIT}{split}"
    settings, wanted = tuple(set), check_streams(streams, images, background)
    found = [e for entry in entries for e in (resolve(entry, settings) if isinstance(entry, str) else [entry])]
    try:
        output_paths(folder, [entry.name for entry in found], source="entries")
    except InputError as error:
        raise error.replaced(remedy='combine them in a suite: entry = [{ suite = "NAME" }, …], see the docs') from None
    if pack:
        return _generate_shards(found, seeds, root, folder, (wanted, images, stride), workers, progress)
    jobs = []
    for entry, seed in product(found, seeds):
        one = replace(entry, scenario=drawn(entry.scenario, seed, entry.repeat))
        check_stride(stride, one.scenario.camera.fps)
        jobs.append(SequenceJob(output_path(folder, one.name, f"-s{seed:05d}"), one, seed, wanted, images, stride))
    with _dataset(root, folder):
        packed = next(folder.glob(f"*/{SHARDS}"), None)
        reject(packed is not None, folder, "a packed dataset", "one of folders", "add --pack, or choose another --out")
        for job in jobs:
            stored_manifest(job)
        errors = _run_jobs(jobs, workers, progress, root, run_job)
        try:
            write_seqmap(root, split)
        except FlockscopeError as error:
            errors["seqmaps"] = error
    unfulfilled = _left_out(errors, len(jobs))
    made = Folders((job.folder for job in jobs if job.name not in unfulfilled), unfulfilled)
    _warn_of_who_stands((path.name, stands_in(path)) for path in made)
    return made


def _warn_of_who_stands(stands: Iterable[tuple[str, dict[str, list[str]]]]) -> None:
    found = list(stands)
    for what in ("group", "person"):
        warn_of(what, found)


def _left_out(errors: dict[str, FlockscopeError], total: int) -> dict[str, OrderError]:
    """Returns the OrderErrors if they are all there is, and few enough; else raises the summary of the errors."""
    unfulfilled = {name: error for name, error in errors.items() if isinstance(error, OrderError)}
    many = len(unfulfilled) > LEFT_OUT * total
    if len(errors) > len(unfulfilled) or many:
        raise _summary({name: e for name, e in errors.items() if many or name not in unfulfilled}, total)
    return unfulfilled


def _generate_shards(
    entries: list[Entry], seeds: range, root: Path, folder: Path, stored: tuple[tuple[str, ...], str, int],
    workers: WorkerOptions, progress: Progress | None,
) -> Folders:  # fmt: skip
    """Does what `generate` does, with shards. stored: streams, file type and stride."""
    hundreds = [(first, tuple(some)) for first, some in groupby(seeds, lambda seed: seed - seed % packs.SEEDS)]
    jobs = []
    for entry, (first, some) in product(entries, hundreds):
        path = output_path(output_path(folder, entry.name), entry.name, f"-s{first:05d}.tar")
        jobs.append(ShardJob(path, entry, some, *stored))
    with _dataset(root, folder):
        other = next(folder.glob(f"*/{MANIFEST}"), None)
        reject(other is not None, folder, "sequences in folders", "a packed dataset", "choose another --out")
        remove_partials(*(job.path.parent for job in jobs))
        for job in jobs:
            check_stride(stored[2], job.job(folder, job.seeds[0]).entry.scenario.camera.fps)
            stored_shard(job)
        errors = _run_jobs(jobs, workers, progress, root, run_shard)
        if packs.shards_in(folder):
            packs.write_index(folder)
    made = Folders((job.path for job in jobs), _left_out(errors, len(entries) * len(seeds)))
    _warn_of_who_stands(one for path in made for one in packs.read_seal(path).facts["stands"].items())
    return made


@contextmanager
def _dataset(root: Path, folder: Path) -> Iterator[None]:
    """Locks the folder of a dataset for the block, and removes what interrupted writers left there; refuses runs."""
    reject_runs(root)
    with lock_folder(root):
        remove_partials(root, folder, root / "seqmaps")
        try:
            yield
        finally:
            remove_partials(root, folder)


def _run_jobs(
    jobs: list[J], workers: WorkerOptions, progress: Progress | None, root: Path, function: Callable[[J], JobOutcome]
) -> dict[str, FlockscopeError]:
    errors: dict[str, dict[str, FlockscopeError]] = {}
    with start_workers(min(workers.count, max(1, len(jobs))), workers.cluster) as run:
        if jobs and workers.cluster is not None:
            marker = root / f"{PARTIAL}{uuid4().hex}"
            write_file(marker, b"")
            jobs = [replace(job, marker=marker) for job in jobs]
        done = run(function, jobs, ahead=QUEUED_JOBS, on_loss=lost_job)
        for count, (job, outcome) in enumerate(done, 1):
            errors[job.name] = {**outcome.left_out, **({} if outcome.error is None else {job.name: outcome.error})}
            if outcome.fatal:
                break
            if progress is not None:
                progress(count, len(jobs), job.name)
    return {name: error for job in jobs for name, error in errors.get(job.name, {}).items()}


def write_seqmap(root: Path, split: str) -> None:
    """Writes ROOT/seqmaps/flockscope-<split>.txt, TrackEval's list of complete sequences, unless there are none."""
    folder = root / f"flockscope-{split}"
    complete = sorted(p.parent.name for p in folder.glob(f"*/{MANIFEST}") if not p.parent.name.startswith("."))
    if complete:
        write_file(root / "seqmaps" / f"flockscope-{split}.txt", "\n".join(["name", *complete, ""]).encode())


def _summary(errors: dict[str, FlockscopeError], total: int) -> FlockscopeError:
    first, *others = errors.values()
    if not others:
        return first
    # One text for all failures: that of the first, and the names of some others.
    names = ", ".join(list(errors)[1:6]) + (", …" if len(others) > 5 else "")
    got, kept = f"{first.got} (and {len(others)} more of {total}: {names})", "; the others are kept"
    kind = type(first) if {type(e) for e in others} == {type(first)} else WorkError
    remedy = first.remedy + ("" if len(errors) == total else kept)
    return kind(**first.as_dict() | {"got": got, "remedy": remedy})


def store_replays(
    sources: Iterable[Sequence], view: ObservationSpec, seeds: range, out: str | Path, *, cut: Cut = WHOLE,
    calibration: Camera | None = None, streams: Iterable[str] = ("left",), images: str = "jpg",
    background: bool = True, progress: Progress | None = None,
) -> list[Path]:  # fmt: skip
    """Stores a replay of every source with every seed in folders named as by `generate`; returns the folders.

    view: camera, sensor, light and picture, with the frame rate. cut: the part of each recording to replay.
    calibration: camera of recordings that have boxes but no ground positions; None if not needed; an
    error for others. streams, images, background, progress: as for `generate`.

    The first error is raised and ends the work; replays stored before it are kept. Recordings of real motion need seeds
    from 20,000 on, else InputError.
    """
    recordings, split, root = list(sources), split_of(seeds), Path(out)
    folder = root / f"flockscope-{split}"
    output_paths(folder, [replay_name(recording.name, cut) for recording in recordings], source="recordings")
    if split in TUNING_SPLITS and any(is_real(recording) for recording in recordings):
        got, expected = f"{seeds.start} ({split})", "seeds from 20000 (test) on, for real motion"
        remedy = "choose other seeds: nothing is tuned on recordings"
        raise InputError(place="--seeds", got=got, expected=expected, remedy=remedy)
    wanted = check_streams(streams, images, background)
    made: list[Path] = []
    with _dataset(root, folder):
        try:
            for recording, seed in product(recordings, seeds):
                sequence, form = resolve_replay(recording, view, seed, cut=cut, calibration=calibration, streams=wanted)
                entry, path = Entry(form.name, cast(Any, form)), output_path(folder, form.name, f"-s{seed:05d}")
                store(SequenceJob(path, entry, seed, wanted, images), sequence)
                made.append(path)
                if progress is not None:
                    progress(len(made), len(recordings) * len(seeds), path.name)
        finally:
            write_seqmap(root, split)
    return made
