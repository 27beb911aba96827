"""Replays as a dataset on disk: every recording with every seed, each a sequence like those of `generate`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from scenarios.errors import InputError
from scenarios.loading.resolve import Entry
from scenarios.loading.toml_files import dump
from scenarios.schema.observation import ObservationSpec, ReplaySpec
from sim.dataset.generate import write_seqmap
from sim.dataset.replay import WHOLE, Cut, resolve_replay
from sim.dataset.sequence_job import SequenceJob, is_stored
from sim.dataset.splits import TUNING_SPLITS, is_real, split_of
from sim.io.files.atomic import remove_partials
from sim.io.files.lock import lock_folder
from sim.io.store import sequence_folder
from sim.io.store.streams import check_streams
from sim.types import Camera, Sequence

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class ReplayOptions:
    """What is alike for all replays of a dataset."""

    view: ObservationSpec
    cut: Cut = WHOLE
    calibration: Camera | str | Path | None = None
    streams: tuple[str, ...] = ("left",)
    images: str = "jpg"


def store_replays(
    sources: Iterable[Sequence], how: ReplayOptions, seeds: range, out: str | Path, progress: Progress | None = None
) -> list[Path]:
    """Make OUT/flockscope-<split>/<recording>-s<seed>/ of every source and seed, and OUT/seqmaps.

    Replays of recordings go to the splits that nothing is tuned on: seeds from 20,000. What is there already is kept.
    InputError where seeds or names do not fit or a folder holds another sequence; see sim.dataset.replay for the rest.
    """
    recordings, split, root = list(sources), split_of(seeds), Path(out)
    _check(recordings, seeds, split)
    folder = root / f"flockscope-{split}"
    how = replace(how, streams=tuple(check_streams(how.streams, how.images)))
    made: list[Path] = []
    with lock_folder(root):
        remove_partials(root, folder, root / "seqmaps")
        try:
            for recording in recordings:
                for seed in seeds:
                    made.append(_store(recording, how, seed, folder))
                    if progress is not None:
                        progress(len(made), len(recordings) * len(seeds), made[-1].name)
        finally:
            remove_partials(root, folder)
            write_seqmap(root, split)
    return made


def _check(recordings: list[Sequence], seeds: range, split: str) -> None:
    names = [recording.name for recording in recordings]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(got=f"two recordings named {twice}", expected="unique names", remedy="give one at a time")
    if split in TUNING_SPLITS and any(is_real(recording) for recording in recordings):
        raise InputError(
            place="--seeds", got=f"{seeds.start} ({split})", expected="seeds from 20000 (test) on, for real motion",
            remedy="choose such: nothing is tuned on recordings",
        )  # fmt: skip


def _store(recording: Sequence, how: ReplayOptions, seed: int, folder: Path) -> Path:
    sequence, form = resolve_replay(
        recording, how.view, seed, cut=how.cut, calibration=how.calibration, streams=how.streams
    )  # fmt: skip
    job = _job(form, seed, folder, how)
    if not is_stored(job):
        sequence_folder.write_sequence(
            job.folder, replace(sequence, name=job.name), scenario=dump(form), seed=seed, streams=how.streams,
            images=how.images, keep=lambda: is_stored(job),
        )  # fmt: skip
    return job.folder


def _job(form: ReplaySpec, seed: int, folder: Path, how: ReplayOptions) -> SequenceJob:
    """The job that knows whether the folder holds this very replay; its resolved form stands for the scenario."""
    entry = Entry(form.name, cast(Any, form))
    return SequenceJob(folder / f"{form.name}-s{seed:05d}", entry, seed, how.streams, how.images)
