"""Write H.264 videos that browsers can play and seek: mp4, yuv420p, a key frame each second, the index in front.

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
    """Return `fps`, frames per second, as the nearest fraction with a denominator up to 1001."""
    return Fraction(fps).limit_denominator(1001)


@contextmanager
def write_video(
    path: Path, size: tuple[int, int], fps: float, quality: int = QUALITY, comment: str = ""
) -> Iterator[VideoWriter]:
    """Give a VideoWriter for an H.264 mp4 file `path`, which is complete after the block; an existing file is
    overwritten.

    size: (width, height) px of all pictures. fps: frames per second, rounded to a fraction with a denominator up to
    1001. quality: x264's constant rate factor, lower is better, default 18. comment: stored in the file, "" for none.
    If the block raises, an incomplete file stays; if it adds no picture, a file without pictures.

    Raises InputError if width or height is odd, OSError if the file cannot be opened or written, as on a full disk, and
    WorkError if the finished video holds another number of pictures than were added.
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
    """Return the number of whole pictures in a video, still encoded; 0 for an unreadable one."""
    import av

    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 and not packet.is_corrupt for packet in container.demux(video=0))
    except (av.FFmpegError, IndexError):
        return 0


class WholeFile:
    """The file that libav writes to: every byte is written, or the first exception is kept and writing ends.

    file: the open raw file. libav goes on after a write that failed or was short, so each caller of libav then calls
    `raise_error`. Ctrl-C, which Python cannot pass through libav, comes out there, too. State: the exception, None as
    long as all is written.
    """

    def __init__(self, file: Any):
        self._file, self.name = file, file.name  # libav opens the name again to move the index
        self.seek, self.tell = file.seek, file.tell
        self._error: BaseException | None = None

    def write(self, data: Any) -> int:
        """Write all bytes; returns their number, also after a failure."""
        rest = memoryview(data)
        try:
            while rest and self._error is None:
                count = self._file.write(rest)
                if not count:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                rest = rest[count:]
        except BaseException as error:
            self._error = error
        return len(data)

    def raise_error(self) -> None:
        """Raise the exception that ended the writing; do nothing if all was written."""
        if self._error is not None:
            raise self._error


class VideoWriter:
    """A video that is being written; made by `write_video`, which also ends and closes it.

    file: what to write to. size: (width, height) of all pictures in px, both even. fps: frames per second. quality:
    x264's constant rate factor, lower is better. comment: stored in the file, "" for none. State: libav's open
    container and stream, and `count`, the number of pictures added.
    """

    def __init__(self, file: WholeFile, size: tuple[int, int], fps: float, quality: int, comment: str):
        import av

        self._file, self.count = file, 0
        self._container: Any = av.open(file, "w", format="mp4", options={"movflags": "faststart"})
        if comment:
            self._container.metadata["comment"] = comment
        group = str(max(1, round(fps)))
        options = {"crf": str(quality), "preset": "veryfast", "g": group, "bf": "2", "threads": "1"}
        self._stream: Any = self._container.add_stream("libx264", rate=rate_of(fps), options=options)
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.thread_count = 1
        context.color_range = NARROW
        context.colorspace = context.color_primaries = context.color_trc = BT601

    def add(self, picture: Image) -> None:
        """Append a picture (H, W, 3) BGR uint8.

        Raises InputError for a picture of another size than the video's, and OSError if the video cannot be written, as
        on a full disk; so do `end` and `close`.
        """
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
        """Encode and write the frames that the encoder still holds; no picture may be added afterwards."""
        self._container.mux(self._stream.encode(None))
        self._file.raise_error()

    def close(self) -> None:
        """Write the index of the file and close the container; the file object that was given stays open."""
        try:
            self._container.close()
        finally:
            self._file.raise_error()
