"""A job makes one sequence of a dataset, from one entry (scenario) and one seed.

This module names its folder, finds out whether the sequence is already stored there undamaged, and otherwise simulates
the scenario and stores the sequence. A worker process can run a job.
"""

from __future__ import annotations

import socket
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scenarios.errors import FlockscopeError, InputError, WorkError, shortened
from scenarios.loading.resolve import Entry
from scenarios.loading.toml_files import Table
from sim.io.files.output_paths import output_path, output_paths
from sim.io.files.own_files import is_side_file
from sim.io.store import sequence_folder
from sim.io.store.seal import MANIFEST, damaged_files, identity, is_own_sequence, read_manifest

MOST = 3  # differences that are named; the others are counted
LONGEST = 40  # characters of a value


def setting_differences(stored: Table, wanted: Table) -> str:
    """Returns the settings that differ between two scenarios, as "camera.fps 10 → 5, duration 20 → 30"."""
    before, after = (dict(_flat("", table)) for table in (stored, wanted))
    keys = [key for key in {**before, **after} if before.get(key) != after.get(key)]
    words = [f"{key} {_value(before, key)} → {_value(after, key)}" for key in keys[:MOST]]
    return ", ".join(words + [f"{len(keys) - MOST} more"] * (len(keys) > MOST))


def _flat(prefix: str, value: Any) -> list[tuple[str, Any]]:
    if isinstance(value, dict):
        dot = "." if prefix else ""
        return [pair for key, inner in value.items() for pair in _flat(f"{prefix}{dot}{key}", inner)]
    if isinstance(value, list) and any(isinstance(inner, dict) for inner in value):
        return [pair for k, inner in enumerate(value) for pair in _flat(f"{prefix}[{k}]", inner)]
    return [(prefix, value)]


def _value(settings: Table, key: str) -> str:
    value = settings.get(key, "none")
    return shortened(str(value).removesuffix(".0") if isinstance(value, float) else str(value), LONGEST)


MARKER_TIMEOUT = 5.0  # s that a shared file system may take to show one machine the file of another


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
class JobOutcome:
    """How a job ended."""

    error: FlockscopeError | None = None  # the error, None if the sequence is stored
    fatal: bool = False  # True if every other job would fail in the same way, as with a full disk


def plan_jobs(entries: list[Entry], seeds: range, folder: Path) -> list[SequenceJob]:
    """Returns one job per entry and seed, without pictures, all seeds of the first entry first."""
    output_paths(folder, [e.name for e in entries], source="entries")
    return [SequenceJob(output_path(folder, e.name, f"-s{seed:05d}"), e, seed) for e in entries for seed in seeds]


def stored_manifest(job: SequenceJob) -> dict[str, Any] | None:
    """Returns the manifest in the job's folder, None without one; raises InputError if it is another sequence's."""
    from scenarios.loading.resolve import dump

    if not job.folder.exists():
        return None
    inside = job.folder.is_dir() and any(not is_side_file(path.name) for path in job.folder.iterdir())
    if not job.folder.is_dir() or (inside and not is_own_sequence(job.folder)):
        raise InputError(
            file=job.folder, got="something that flockscope did not write", expected="a stored sequence, or nothing",
            remedy="choose another --out, or move it away",
        )  # fmt: skip
    path = job.folder / MANIFEST
    if not path.exists():
        return None
    try:
        manifest = read_manifest(job.folder)
    except InputError as error:
        # An invalid manifest does not tell what the folder holds.
        remedy = "delete that folder, or choose another --out"
        raise InputError(**{**error.as_dict(), "remedy": remedy}) from None
    scenario = dump(job.entry.scenario)
    wanted = {**identity(scenario, job.seed, job.entry.repeat, job.streams, job.images), "stride": job.stride}
    manifest = {"stride": 1, **manifest}
    different = {key: value for key, value in wanted.items() if manifest.get(key) != value}
    if different:
        expected = "the same scenario, version, streams and images, or an empty place"
        raise InputError(
            file=job.folder, got=f"another sequence (stored → asked for: {_differences(job, manifest, different)})",
            expected=expected, remedy="choose another --out, or delete that folder",
        )  # fmt: skip
    return manifest


def _differences(job: SequenceJob, manifest: dict[str, Any], different: dict[str, Any]) -> str:
    from scenarios.loading.toml_files import dump, parse
    from scenarios.reading import parse_toml

    settings = ""
    if "scenario_hash" in different:
        with suppress(InputError):
            settings = setting_differences(parse(job.folder / "scenario.toml"), parse_toml(dump(job.entry.scenario)))
    fields = {key: value for key, value in different.items() if key != "scenario_hash" or not settings}
    return ", ".join(
        [settings] * bool(settings) + [f"{k} {_word(manifest.get(k))} → {_word(v)}" for k, v in fields.items()]
    )


def _word(value: Any) -> str:
    text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
    return "none" if value is None or not text else text


def is_stored(job: SequenceJob) -> bool:
    """Returns True if the folder holds the job's sequence, and every file has the hash of its manifest."""
    manifest = stored_manifest(job)
    return manifest is not None and next(damaged_files(job.folder, manifest["files"]), None) is None


def simulate_and_store(job: SequenceJob) -> None:
    """Simulates the job's scenario and writes its folder, replacing a damaged one."""
    from scenarios.loading.resolve import dump
    from sim.sequence import simulate

    entry = job.entry
    try:
        sequence = replace(simulate(entry.scenario, job.seed, entry.repeat, job.streams, job.stride), name=job.name)
        sequence_folder.write_sequence(
            job.folder, sequence, scenario=dump(entry.scenario), seed=job.seed, repeat=entry.repeat,
            streams=job.streams, images=job.images, keep=lambda: is_stored(job),
        )  # fmt: skip
    except FlockscopeError as error:
        # A full disk: it would hit every other job, too.
        if isinstance(error.__cause__, OSError):
            raise
        raise type(error)(**{**error.as_dict(), "file": entry.file or error.file or job.name}) from error
    except Exception as error:
        raise WorkError(
            file=job.name, got=f"{type(error).__name__}: {error}", expected="a sequence",
            remedy="report it with the scenario and seed",
        ) from error  # fmt: skip


def run_job(job: SequenceJob) -> JobOutcome:
    """Makes the job's sequence unless it is stored undamaged; errors are in the outcome, not raised."""
    try:
        if job.marker is not None:
            _wait_for_marker(job.marker)
        if not is_stored(job):
            simulate_and_store(job)
    except FlockscopeError as error:
        fatal = isinstance(error.__cause__, OSError)
        if fatal and job.marker is not None:
            error = type(error)(**{**error.as_dict(), "place": f"on {socket.gethostname()}"})
        return JobOutcome(error, fatal)
    return JobOutcome()


def lost_job(job: SequenceJob, error: WorkError) -> JobOutcome:
    """Returns the outcome of a job that killed too many workers."""
    return JobOutcome(WorkError(**{**error.as_dict(), "file": job.name}))


def _wait_for_marker(marker: Path) -> None:
    end = time.monotonic() + MARKER_TIMEOUT
    while not marker.exists():
        if time.monotonic() > end:
            raise InputError(
                file=marker.parent, got="another folder, or none", expected="the one that the command writes to",
                remedy="choose an --out that all machines share under the same path",
            ) from FileNotFoundError(marker)  # fmt: skip
        time.sleep(MARKER_TIMEOUT / 20)
