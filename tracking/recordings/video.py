"""Reader for video files, as Sequences: every frame has a number, also one that cannot be decoded.

A frame that cannot be decoded has no picture. The container's frame rate is often wrong, so it is used only if the time
stamps agree with it or tell no plausible rate. Where the rate varies, each frame has the time that the file states.
Pictures have square pixels. Sound is ignored.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from sim.pictures import video_files
from sim.pictures.background_sample import BackgroundChoice, BackgroundSample
from sim.pictures.picture_folder import fill_gaps, require_size, size_of
from sim.scene.camera import scaled_to_image
from sim.store.recorded_sequence import recorded_sequence
from sim.types import Array, Image, Sequence
from tracking.recordings.options import NO_OPTIONS, RATES, RecordingOptions

SUFFIXES = (
    ".mp4", ".m4v", ".mov", ".3gp", ".mkv", ".webm", ".avi", ".wmv", ".flv", ".ogv", ".mpg", ".mpeg",
    ".ts", ".mts", ".m2ts", ".h264", ".h265", ".hevc", ".y4m",
)  # fmt: skip
AGREE = 0.02  # relative difference allowed between the container's rate and that of the time stamps
GAP, GAPS = 1.0, 5.0  # a step longer than 1 s and than 5 usual steps is a gap, and no part of the rate
DEFAULT_FPS = 25.0


def open_video(path: Path, options: RecordingOptions = NO_OPTIONS) -> Sequence:
    """Returns a video file as Sequence whose pictures are decoded while iterating.

    A frame that cannot be decoded has no picture, with a warning. Times are those of the file if the rate varies.
    """
    index = video_files.index_packets(path)
    length = len(index.stamps)
    first = next((picture for _, picture in video_files.decode_frames(path, index)), None)
    if first is None:
        got = f"{length} frames, none of which can be decoded" if length else "no frame"
        raise InputError(file=path, got=got, expected="a video with pictures", remedy=video_files.REMEDY)
    if words := missing(index):
        warnings.warn(f"{path.name}: {words}", stacklevel=2)
    if index.aspect != 1:
        words = f"pixels of shape {index.aspect.numerator}:{index.aspect.denominator} are made square"
        warnings.warn(f"{path.name}: {words}: pictures of {size_of(first)[0]}×{size_of(first)[1]} px", stacklevel=2)
    size = size_of(first)
    rate, words = frame_rate(path.name, options.fps, index)
    choice = (options.background or BackgroundChoice()).of(length, path, size)
    times = None if options.fps is not None or index.ranks() is None or is_steady(index.times()) else index.times()
    source = {"kind": "video", "path": str(path), "fps": words, "background": str(choice)}

    def pictures(wanted: list[int] | None = None) -> Iterator[tuple[int, Image]]:
        found = video_files.decode_frames(path, index, wanted)
        return ((k, require_size(picture, size, path, f"frame {k}")) for k, picture in found)

    return recorded_sequence(
        source, path.stem, rate, length, times=None if times is None else (times - times[0]).tolist(),
        left=lambda: fill_gaps(pictures(), length, path.name), image_size=size,
        camera=options.camera and scaled_to_image(options.camera, size, path, index.aspect), px_per_m=options.scale,
        load_background=BackgroundSample(choice, length, path, pictures),
    )  # fmt: skip


def missing(index: video_files.PacketIndex) -> str:
    """Returns a warning if the end of a video is missing, else ""."""
    length = len(index.stamps)
    if index.broken:
        return f"breaks off after {length} frames ({index.broken})"
    return f"ends after {length} of the {index.promised} frames it promises" if length < index.promised else ""


def frame_rate(name: str, given: float | None, index: video_files.PacketIndex) -> tuple[float, str]:
    """Returns the frames per second, and words for their source. Warns unless they are given or the container's."""
    if given is not None:
        return given, f"{given:g}, as given"
    header, timed, steady = index.rate, stamped_rate(index), is_steady(index.times())
    # Containers often state a wrong rate: it must agree with the stamps, or they tell none.
    if _plausible(header) and (not _plausible(timed) or (steady and abs(header / timed - 1) <= AGREE)):
        return header, f"{header:g}, as the container says"
    rate, text = DEFAULT_FPS, f"{DEFAULT_FPS:g} (the container says {header:g}, its time stamps {timed:g})"
    if _plausible(timed):
        varying = "" if steady else ", which vary"
        rate, text = timed, f"{timed:g} by its time stamps{varying} (the container says {header:g})"
    warnings.warn(f"{name}: frames per second taken as {text}; --fps says otherwise", stacklevel=3)
    return rate, text


def _plausible(rate: float) -> bool:
    return RATES[0] <= rate <= RATES[1]


def is_steady(times: Array) -> bool:
    """Returns True if times (s, ascending) are within half a step of evenly spaced times from first to last."""
    if len(times) < 3:
        return True
    off = times - np.linspace(times[0], times[-1], len(times))
    return bool(np.abs(off).max() <= (times[-1] - times[0]) / (len(times) - 1) / 2)


def stamped_rate(index: video_files.PacketIndex) -> float:
    """Returns the frames per second by the packets' time stamps, without gaps; 0 with fewer than two stamps."""
    step = np.diff(index.times())
    gap = max(GAP, GAPS * float(np.median(step)) if len(step) else 0.0)
    step = step[step <= gap]
    return round(len(step) / float(step.sum()), 3) if len(step) else 0.0
