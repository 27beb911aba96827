"""Store replays as a dataset: every recording with every seed, each as a sequence folder as `generate` writes it."""

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
from sim.dataset.replay import WHOLE, Cut, replay_name, resolve_replay
from sim.dataset.sequence_job import SequenceJob, is_stored
from sim.dataset.splits import TUNING_SPLITS, is_real, split_of
from sim.io.files.atomic import remove_partials
from sim.io.files.lock import lock_folder
from sim.io.files.output_paths import output_path, output_paths
from sim.io.store import sequence_folder
from sim.io.store.streams import check_streams
from sim.types import Camera, Sequence

Progress = Callable[[int, int, str], None]


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
    job = _job(form, seed, folder, options)
    if not is_stored(job):
        sequence_folder.write_sequence(
            job.folder, replace(sequence, name=job.name), scenario=dump(form), seed=seed, streams=options.streams,
            images=options.images, keep=lambda: is_stored(job),
        )  # fmt: skip
    return job.folder


def _job(form: ReplaySpec, seed: int, folder: Path, options: ReplayOptions) -> SequenceJob:
    entry = Entry(form.name, cast(Any, form))
    return SequenceJob(output_path(folder, form.name, f"-s{seed:05d}"), entry, seed, options.streams, options.images)
