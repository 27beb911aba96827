"""Many sequences at once: every entry with every seed, stored as a dataset, by as many processes as wanted.

A sequence is whole or not there, so an interrupted run goes on where it was; what is stored depends on scenario,
seed and versions alone, never on the number of workers.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.loading import Entry
from sim.io import store
from sim.io.atomic import refusal, sweep, write_file
from sim.io.manifest import MANIFEST, altered, identity, read_manifest
from sim.io.streams import chosen
from sim.splits import split_of

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Job:
    """One sequence to make: where, and of what."""

    folder: Path
    entry: Entry
    seed: int
    streams: tuple[str, ...] = ()
    images: str = "jpg"

    @property
    def name(self) -> str:
        """The sequence's name."""
        return self.folder.name


def generate(
    entries: Iterable[Entry | str],
    seeds: range,
    out: str | Path,
    *,
    set: Iterable[str] = (),
    workers: int = 1,
    progress: Progress | None = None,
    streams: Iterable[str] = ("left",),
    images: str = "jpg",
) -> list[Path]:
    """Make OUT/flockscope-<split>/<name>-s<seed>/ of every entry (or name of one) and seed, and OUT/seqmaps.

    Sequences that are complete and of the same scenario and seed are kept. progress(done, all, name) is called after
    each. streams, images: the pictures to store (sim.io.streams.STREAMS, () none), and as what. InputError before
    anything is made where names clash, the range is wrong, or a folder holds another scenario's sequence; WorkError at
    the end, the others kept, where a sequence failed; at once where nothing can be written any more.
    """
    if workers < 1:
        raise InputError(place="workers", got=workers, expected="1 or more", remedy="correct --workers")
    split, root = split_of(seeds), Path(out)
    folder = root / f"flockscope-{split}"
    pictures = chosen(streams, images)
    jobs = [replace(job, streams=pictures, images=images) for job in plan(_resolved(entries, set), seeds, folder)]
    with _alone(root):
        sweep(folder, root / "seqmaps")
        waiting = [job for job in jobs if not is_done(job)]
        try:
            errors = _run(waiting, workers, _counted(progress, len(jobs) - len(waiting), len(jobs)))
        finally:
            sweep(folder)
        try:
            write_seqmap(root, split)
        except FlockscopeError as error:
            errors["seqmaps"] = error
    if errors:
        raise _summary(errors, len(jobs))
    return [job.folder for job in jobs]


def _resolved(entries: Iterable[Entry | str], set: Iterable[str]) -> list[Entry]:
    from scenarios.loading import resolve

    settings = tuple(set)
    return [e for entry in entries for e in (resolve(entry, settings) if isinstance(entry, str) else [entry])]


def plan(entries: list[Entry], seeds: range, folder: Path) -> list[Job]:
    """The jobs in order of entry and seed; InputError where two entries would be one folder."""
    names = [e.name for e in entries]
    twice = next((n for k, n in enumerate(names) if n in names[:k]), None)
    if twice is not None:
        raise InputError(
            place="entries", got=f"{twice} twice", expected="unique names", remedy="give it once, or rename one"
        )
    return [Job(folder / f"{e.name}-s{seed:05d}", e, seed) for e in entries for seed in seeds]


def is_done(job: Job) -> bool:
    """Whether the folder holds this very sequence, whole. InputError where it holds another one."""
    from scenarios.loading import dump

    if not job.folder.exists():
        return False
    try:
        manifest = read_manifest(job.folder)
    except InputError:
        return False
    wanted = identity(dump(job.entry.scenario), job.seed, job.entry.repeat, job.streams, job.images)
    other = [key for key, value in wanted.items() if manifest.get(key) != value]
    if other:
        expected = "the same scenario, version, streams and images, or nothing"
        raise InputError(
            file=job.folder, place=MANIFEST, got=f"another sequence ({', '.join(other)} differ)",
            expected=expected, remedy="choose another --out, or delete that folder",
        )  # fmt: skip
    return next(altered(job.folder, manifest), None) is None


def make(job: Job) -> None:
    """Simulate and store one sequence; any failure as WorkError or InputError that names the scenario's file."""
    from scenarios.loading import dump
    from sim.sequence import simulate

    entry = job.entry
    try:
        sequence = replace(simulate(entry.scenario, job.seed, entry.repeat, job.streams), name=job.name)
        store.write_sequence(
            job.folder, sequence, scenario=dump(entry.scenario), seed=job.seed, repeat=entry.repeat,
            streams=job.streams, images=job.images,
        )  # fmt: skip
    except FlockscopeError as error:
        if isinstance(error.__cause__, OSError):
            raise
        raise type(error)(**{**error.as_dict(), "file": entry.file or error.file or job.name}) from error
    except Exception as error:
        raise WorkError(
            file=job.name, got=f"{type(error).__name__}: {error}", expected="a sequence",
            remedy="report it with the scenario and seed",
        ) from error  # fmt: skip


def _attempt(job: Job) -> tuple[FlockscopeError | None, bool]:
    """What went wrong, and whether it will with all others too: a disk that takes no more."""
    try:
        make(job)
    except FlockscopeError as error:
        return error, isinstance(error.__cause__, OSError)
    return None, False


def _run(jobs: list[Job], workers: int, done: Callable[[Job], None]) -> dict[str, FlockscopeError]:
    """Make all, as long as something can be written; the errors by sequence, in the order of the jobs."""
    errors: dict[str, FlockscopeError] = {}
    with closing(_attempts(jobs, min(workers, len(jobs)))) as attempts:
        for job, (error, hopeless) in attempts:
            if error is not None:
                errors[job.name] = error
            if hopeless:
                break
            done(job)
    return {job.name: errors[job.name] for job in jobs if job.name in errors}


def _attempts(jobs: list[Job], workers: int) -> Generator[tuple[Job, tuple[FlockscopeError | None, bool]], None, None]:
    if workers <= 1:
        yield from ((job, _attempt(job)) for job in jobs)
        return
    from sim.workers import pool

    with pool(workers) as run:
        yield from run(_attempt, jobs)


def _counted(progress: Progress | None, before: int, total: int) -> Callable[[Job], None]:
    count = before

    def done(job: Job) -> None:
        nonlocal count
        count += 1
        if progress is not None:
            progress(count, total, job.name)

    return done


def write_seqmap(root: Path, split: str) -> None:
    """seqmaps/flockscope-<split>.txt: every complete sequence of the split, sorted, as TrackEval reads it."""
    folder = root / f"flockscope-{split}"
    complete = sorted(p.parent.name for p in folder.glob(f"*/{MANIFEST}") if not p.parent.name.startswith("."))
    if complete:
        write_file(root / "seqmaps" / f"flockscope-{split}.txt", "\n".join(["name", *complete, ""]).encode())


def _summary(errors: dict[str, FlockscopeError], total: int) -> FlockscopeError:
    """The first error, and which other sequences failed; a single one as it is."""
    first, *_ = errors.values()
    if len(errors) == 1:
        return first
    others = ", ".join(list(errors)[1:6]) + (", …" if len(errors) > 6 else "")
    kind = type(first) if len({type(e) for e in errors.values()}) == 1 else WorkError
    return kind(
        file=first.file, place=first.place, got=f"{first.got} (and {len(errors) - 1} more of {total}: {others})",
        expected=first.expected, remedy=first.remedy + ("" if len(errors) == total else "; the others are kept"),
    )  # fmt: skip


@contextmanager
def _alone(root: Path) -> Iterator[None]:
    """One run at a time in a folder, where the system can tell; a folder made for nothing goes away again."""
    made = [p for p in (root, *root.parents) if not p.exists()]
    try:
        root.mkdir(parents=True, exist_ok=True)
        with _lock(root):
            yield
    except OSError as error:
        raise refusal(root, error) from error
    finally:
        with suppress(OSError):
            for folder in made:
                folder.rmdir()


@contextmanager
def _lock(root: Path) -> Iterator[None]:
    try:
        import fcntl
    except ImportError:
        yield
        return
    descriptor = os.open(root, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                file=root,
                got="another run at work here",
                expected="one at a time",
                remedy="wait, or choose another --out",
            ) from None
        yield
    finally:
        os.close(descriptor)
