"""One sequence of a dataset to make: where, and of what; whether it is there; how it is made, here or elsewhere."""

from __future__ import annotations

import socket
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.loading.resolve import Entry
from sim.io.store import sequence_folder
from sim.io.store.manifest import MANIFEST, altered, identity, read_manifest

LATER = 5.0  # s after which a file that one machine has written is seen by another


@dataclass(frozen=True)
class Job:
    """One sequence to make; mark: a file that whoever makes it must see, or it would write somewhere else."""

    folder: Path
    entry: Entry
    seed: int
    streams: tuple[str, ...] = ()
    images: str = "jpg"
    mark: Path | None = None

    @property
    def name(self) -> str:
        """The sequence's name."""
        return self.folder.name


@dataclass(frozen=True)
class Outcome:
    """What went wrong, if anything did, and whether it will with all others too: a disk that takes no more."""

    error: FlockscopeError | None = None
    hopeless: bool = False


def plan(entries: list[Entry], seeds: range, folder: Path) -> list[Job]:
    """The jobs in order of entry and seed; InputError where two entries would be one folder."""
    names = [e.name for e in entries]
    twice = next((n for k, n in enumerate(names) if n in names[:k]), None)
    if twice is not None:
        raise InputError(
            place="entries", got=f"{twice} twice", expected="unique names", remedy="give it once, or rename one"
        )
    return [Job(folder / f"{e.name}-s{seed:05d}", e, seed) for e in entries for seed in seeds]


def begun(job: Job) -> dict[str, Any] | None:
    """The manifest of this very sequence where there is one; InputError where the folder holds another."""
    from scenarios.loading.resolve import dump

    if not job.folder.exists():
        return None
    try:
        manifest = read_manifest(job.folder)
    except InputError:
        return None
    wanted = identity(dump(job.entry.scenario), job.seed, job.entry.repeat, job.streams, job.images)
    other = [key for key, value in wanted.items() if manifest.get(key) != value]
    if other:
        expected = "the same scenario, version, streams and images, or nothing"
        raise InputError(
            file=job.folder, place=MANIFEST, got=f"another sequence ({', '.join(other)} differ)",
            expected=expected, remedy="choose another --out, or delete that folder",
        )  # fmt: skip
    return manifest


def is_done(job: Job) -> bool:
    """Whether the folder holds this very sequence, whole to the last byte. InputError where it holds another one."""
    manifest = begun(job)
    return manifest is not None and next(altered(job.folder, manifest), None) is None


def make(job: Job) -> None:
    """Simulate and store one sequence; any failure as WorkError or InputError that names the scenario's file."""
    from scenarios.loading.resolve import dump
    from sim.sequence import simulate

    entry = job.entry
    try:
        sequence = replace(simulate(entry.scenario, job.seed, entry.repeat, job.streams), name=job.name)
        sequence_folder.write_sequence(
            job.folder, sequence, scenario=dump(entry.scenario), seed=job.seed, repeat=entry.repeat,
            streams=job.streams, images=job.images, keep=lambda: is_done(job),
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


def attempt(job: Job) -> Outcome:
    """See to it that the sequence is there; what goes wrong elsewhere says on which machine."""
    try:
        if job.mark is not None:
            _look_for(job.mark)
        if not is_done(job):
            make(job)
    except FlockscopeError as error:
        hopeless = isinstance(error.__cause__, OSError)
        if hopeless and job.mark is not None:
            error = type(error)(**{**error.as_dict(), "place": f"on {socket.gethostname()}"})
        return Outcome(error, hopeless)
    return Outcome()


def given_up(job: Job, error: WorkError) -> Outcome:
    """The outcome of a job that has cost too many workers."""
    return Outcome(WorkError(**{**error.as_dict(), "file": job.name}))


def _look_for(mark: Path) -> None:
    end = time.monotonic() + LATER
    while not mark.exists():
        if time.monotonic() > end:
            raise InputError(
                file=mark.parent, got="another folder, or none", expected="the one that the command writes to",
                remedy="choose an --out that all machines share under the same path",
            ) from FileNotFoundError(mark)  # fmt: skip
        time.sleep(LATER / 20)
