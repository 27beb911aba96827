"""Writes H.264 videos that browsers can play and seek: mp4, yuv420p, a key frame each second, the index in front.

One thread is used and no date is written, so the same pictures give the same bytes. libav ignores a write that fails
or takes only a part, as on a full disk. So the file that it writes to keeps account, and the pictures of the finished
video are counted.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, WorkError
from sim.types import Image

QUALITY = 18  # x264's constant rate factor: visually near the original
BT601, NARROW = 6, 1  # libav's numbers of the colour matrix and range that OpenCV converts to


def rate_of(fps: float) -> Fraction:
    """Returns `fps` as the nearest fraction with a denominator up to 1001."""
    return Fraction(fps).limit_denominator(1001)


@contextmanager
def write_video(
    path: Path, size: tuple[int, int], fps: float, quality: int = QUALITY, comment: str = ""
) -> Iterator[VideoWriter]:
    """Yields a VideoWriter for an H.264 mp4 file, which is complete after the block.

    size: (width, height) px, both even. quality: x264's constant rate factor, lower is better. Raises OSError if the
    file cannot be written, and WorkError if the finished video lacks pictures.
    """
    if size[0] % 2 or size[1] % 2:
        raise InputError(
            place="--images mp4", got="pictures of {}×{} px".format(*size), expected="an even width and height",
            remedy="take --images jpg or png, or another camera.image",
        )  # fmt: skip
    # We open the file because libav leaves its own open if a video cannot be finished. It is unbuffered, since Ctrl-C
    # would be lost inside a Python callback from libav.
    with path.open("wb", buffering=0) as file:
        made = VideoWriter(WholeFile(file), size, fps, quality, comment)
        try:
            yield made
            made.end()
        finally:
            made.close()
    written = _pictures_in(path) if made.count else 0
    if written != made.count:
        raise WorkError(
            file=path, got=f"{written} of {made.count} pictures in the finished video", expected="all of them",
            remedy="free some room on the disk, then run it again",
        )  # fmt: skip


def _pictures_in(path: Path) -> int:
    import av

    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 and not packet.is_corrupt for packet in container.demux(video=0))
    except (av.FFmpegError, IndexError):
        return 0


class WholeFile:
    """The file that libav writes to: every byte is written, or the first exception is kept and writing ends.

    State: the exception, None as long as all is written. Each caller of libav then calls `raise_error`.
    """

    def __init__(self, file: Any):
        self._file, self.name = file, file.name  # libav opens the name again to move the index
        self.seek, self.tell = file.seek, file.tell
        self._error: BaseException | None = None

    def write(self, data: Any) -> int:
        """Writes all bytes; returns their number, also after a failure."""
        rest = memoryview(data)
        try:
            while rest and self._error is None:
                count = self._file.write(rest)
                if not count:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                rest = rest[count:]
        # libav goes on after an exception, also after Ctrl-C.
        except BaseException as error:
            self._error = error
        return len(data)

    def raise_error(self) -> None:
        """Raises the exception that ended the writing."""
        if self._error is not None:
            raise self._error


class VideoWriter:
    """A video that is being written; made by `write_video`, which also ends and closes it.

    State: libav's open container and stream, and `count`, the number of pictures added.
    """

    def __init__(self, file: WholeFile, size: tuple[int, int], fps: float, quality: int, comment: str):
        import av

        self._file, self.count = file, 0
        self._container: Any = av.open(file, "w", format="mp4", options={"movflags": "faststart"})
        if comment:
            self._container.metadata["comment"] = comment
        group = str(max(1, round(fps)))
        # x264's macroblock tree reads memory that it never wrote where pictures are not a multiple of 128 px wide, and
        # the same pictures give other bytes now and then.
        options = {"crf": str(quality), "preset": "veryfast", "g": group, "bf": "2", "threads": "1", "mbtree": "0"}
        self._stream: Any = self._container.add_stream("libx264", rate=rate_of(fps), options=options)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        # The same pictures give the same bytes.
        context.thread_count = 1
        context.color_range = NARROW
        context.colorspace = context.color_primaries = context.color_trc = BT601

    def add(self, picture: Image) -> None:
        """Appends a picture (H, W, 3) BGR uint8."""
        import av
        import cv2

        width, height = self._stream.width, self._stream.height
        if picture.shape[:2] != (height, width):
            raise InputError(
                file=self._file.name, place=f"picture {self.count + 1}",
                got="{1}×{0} px".format(*picture.shape), expected=f"{width}×{height} px, the size of the video",
                remedy="give pictures of one size",
            )  # fmt: skip
        planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), np.uint8)
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        frame.color_range, frame.colorspace = NARROW, BT601
        self._container.mux(self._stream.encode(frame))
        self._file.raise_error()
        self.count += 1

    def end(self) -> None:
        """Writes the frames that the encoder still holds."""
        self._container.mux(self._stream.encode(None))
        self._file.raise_error()

    def close(self) -> None:
        """Writes the index of the file and closes the container."""
        try:
            self._container.close()
        finally:
            self._file.raise_error()
