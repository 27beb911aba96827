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
    """Options that all replays of a dataset share.

    view: camera, sensor, light and picture, with the frame rate. cut: the part of each recording to replay, default
    all. calibration: camera, or its file, of recordings that have boxes but no ground positions; None if not needed; an
    error for others. streams: pictures to store, some of "left", "right", "disparity", "ids", "background"; () for
    none. images: their file type, "jpg", "png" or "mp4".
    """

    view: ObservationSpec
    cut: Cut = WHOLE
    calibration: Camera | str | Path | None = None
    streams: tuple[str, ...] = ("left",)
    images: str = "jpg"


def store_replays(
    sources: Iterable[Sequence], options: ReplayOptions, seeds: range, out: str | Path, progress: Progress | None = None
) -> list[Path]:
    """Write OUT/flockscope-<split>/<recording>-s<seed>/ for every source and seed, and OUT/seqmaps; returns the
    folders.

    All seeds of the first source come first; no sources give []. <recording> is the recording's name, with "-" for
    characters other than letters, digits, "_", "." and "-", with "replay-" in front if it does not begin with a letter,
    and with "-t<start in s>" for a cut that begins later. A
    stored replay with the same options is kept if its files are intact. progress: called as progress(replays done,
    replays in all, name of the last one) after each replay. The first error ends the work; replays stored before it are
    kept and listed in OUT/seqmaps.

    Raises InputError if `seeds` is empty or spans two splits, two recordings share a name, a recording of real motion
    is given with seeds below 20,000 (the tuning splits), a stream or file type is unknown, a folder holds another
    sequence, or another process writes to `out`. Also raises InputError as sim.replay, as for a source without labelled
    people or a cut outside it. Raises WorkError if the disk is full.
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
    """Return the SequenceJob of one replay; its folder is folder/<name>-s<seed, 5 digits>.

    form: the replay's specification, which takes the scenario's place. folder: OUT/flockscope-<split>. options: give
    streams and images.
    """
    entry = Entry(form.name, cast(Any, form))
    return SequenceJob(output_path(folder, form.name, f"-s{seed:05d}"), entry, seed, options.streams, options.images)
