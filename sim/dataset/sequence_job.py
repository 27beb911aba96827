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

from scenarios.errors import FlockscopeError, InputError, WorkError
from scenarios.loading.resolve import Entry
from sim.dataset.setting_differences import setting_differences
from sim.io.files.output_paths import output_path, output_paths
from sim.io.files.side_files import is_side_file
from sim.io.store import sequence_folder
from sim.io.store.manifest import MANIFEST, damaged_files, identity, is_own_sequence, read_manifest
from sim.io.store.manifest_check import check_manifest

MARKER_TIMEOUT = 5.0  # s that a shared file system may take to show one machine the file of another


@dataclass(frozen=True)
class SequenceJob:
    """One sequence to make.

    folder: where it is stored; its last part is the sequence's name. entry: the scenario to simulate. seed: the random
    seed. streams: pictures to store, some of "left", "right", "disparity", "ids", "background"; () for none. images:
    their file type, "jpg", "png" or "mp4". stride: N stores every N-th frame of the camera. marker: a file that a
    worker must see before it starts, because it would otherwise write to another file system; None for local workers.
    """

    folder: Path
    entry: Entry
    seed: int
    streams: tuple[str, ...] = ()
    images: str = "jpg"
    stride: int = 1
    marker: Path | None = None

    @property
    def name(self) -> str:
        """The sequence's name, the last part of `folder`: <entry>-s<seed, 5 digits>."""
        return self.folder.name


@dataclass(frozen=True)
class JobOutcome:
    """How a job ended.

    error: the error, None if the sequence is stored. fatal: True if every other job would fail in the same way, as with
    a full disk.
    """

    error: FlockscopeError | None = None
    fatal: bool = False


def plan_jobs(entries: list[Entry], seeds: range, folder: Path) -> list[SequenceJob]:
    """Return one job per entry and seed, all seeds of the first entry first; the jobs store no pictures.

    folder: OUT/flockscope-<split>; each job's folder is <entry>-s<seed, at least 5 digits> in it. No entries give no
    jobs. Raises InputError if two entries would share a folder.
    """
    output_paths(folder, [e.name for e in entries], source="entries")
    return [SequenceJob(output_path(folder, e.name, f"-s{seed:05d}"), e, seed) for e in entries for seed in seeds]


def stored_manifest(job: SequenceJob) -> dict[str, Any] | None:
    """Return the manifest in the job's folder; None if the folder or its manifest is missing.

    The files are not compared with the manifest. Raises InputError for an invalid manifest, which does not tell what
    the folder holds, and if the folder holds another sequence, that is, if the manifest differs in scenario, seed,
    repeat, schema, engine, streams, file type or stride; the error names what differs. Also raises InputError if the
    folder is a file or holds something else than a sequence, or a stream or the file type of the job is unknown.
    """
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
        manifest = check_manifest(path, read_manifest(job.folder))
    except InputError as error:
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
    """Return what differs between the stored sequence and the job's, as "camera.fps 10 → 5, seed 1 → 2".

    different: wanted values of the fields of `manifest` that differ. Settings are named if the stored scenario.toml is
    readable; else the field "scenario_hash" stands for them.
    """
    from scenarios.loading.toml_files import dump, parse
    from scenarios.parsing import parse_toml

    settings = ""
    if "scenario_hash" in different:
        with suppress(InputError):
            settings = setting_differences(parse(job.folder / "scenario.toml"), parse_toml(dump(job.entry.scenario)))
    fields = {key: value for key, value in different.items() if key != "scenario_hash" or not settings}
    return ", ".join(
        [settings] * bool(settings) + [f"{k} {_word(manifest.get(k))} → {_word(v)}" for k, v in fields.items()]
    )


def _word(value: Any) -> str:
    """Return a field of a manifest as a word: a list with commas, "none" for None and an empty list."""
    text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
    return "none" if value is None or not text else text


def is_stored(job: SequenceJob) -> bool:
    """Return True if the folder holds the job's sequence and every file has the hash that its manifest names.

    Returns False if the folder or a valid manifest is missing, or a file is missing or altered. Files that the manifest
    does not name are ignored. Raises InputError if the folder holds another sequence, or a stream or the file type of
    the job is unknown.
    """
    manifest = stored_manifest(job)
    return manifest is not None and next(damaged_files(job.folder, manifest), None) is None


def simulate_and_store(job: SequenceJob) -> None:
    """Simulate the job's scenario and write its folder, replacing a damaged one.

    If another process has stored the same sequence meanwhile, that one stays. Raises InputError (impossible scenario or
    pictures, another sequence in the folder) or WorkError (unfulfilled order), with the scenario's file in the error.
    Any other exception becomes a WorkError. An InputError or WorkError that an OSError caused, as a full disk, is
    raised unchanged.
    """
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
        if isinstance(error.__cause__, OSError):
            raise
        raise type(error)(**{**error.as_dict(), "file": entry.file or error.file or job.name}) from error
    except Exception as error:
        raise WorkError(
            file=job.name, got=f"{type(error).__name__}: {error}", expected="a sequence",
            remedy="report it with the scenario and seed",
        ) from error  # fmt: skip


def run_job(job: SequenceJob) -> JobOutcome:
    """Make the job's sequence unless it is already stored undamaged; returns how that ended.

    InputError and WorkError are returned in the JobOutcome, not raised. The outcome is fatal if an OSError caused the
    error, as a full disk or a marker file that the worker cannot see within 5 s. The fatal error of a job with a marker
    names the worker's machine.
    """
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
    """Return the outcome of a job that killed too many workers: a copy of `error` with the job's name as file, not
    fatal.
    """
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
