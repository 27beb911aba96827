"""Write H.264 videos that browsers can play and seek: mp4, yuv420p, a key frame each second, the index in front.

One thread is used and no date is written, so the same pictures give the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.types import Image

QUALITY = 18  # x264's constant rate factor: visually near the original
BT601, NARROW = 6, 1  # libav's numbers of the colour matrix and range that OpenCV converts to


def rate_of(fps: float) -> Fraction:
    """Return `fps`, frames per second, as the nearest fraction with a denominator up to 1001."""
    return Fraction(fps).limit_denominator(1001)


@contextmanager
def write_video(path: Path, size: tuple[int, int], fps: float, quality: int = QUALITY) -> Iterator[VideoWriter]:
    """Give a VideoWriter for an H.264 mp4 file `path`, which is complete after the block; an existing file is
    overwritten.

    size: (width, height) px of all pictures. fps: frames per second, rounded to a fraction with a denominator up to
    1001. quality: x264's constant rate factor, lower is better, default 18. If the block raises, an incomplete file
    stays; if it adds no picture, an empty file. Raises InputError if width or height is
    odd, OSError if the file cannot be opened.
    """
    if size[0] % 2 or size[1] % 2:
        raise InputError(
            place="--images mp4", got="pictures of {}×{} px".format(*size), expected="an even width and height",
            remedy="take --images jpg or png, or another camera.image",
        )  # fmt: skip
    # We open the file because libav leaves its own open if a video cannot be finished. It is unbuffered, since Ctrl-C
    # would be lost inside a Python callback from libav.
    with path.open("wb", buffering=0) as file:
        made = VideoWriter(file, size, fps, quality)
        try:
            yield made
            made.end()
        finally:
            made.close()


class VideoWriter:
    """A video that is being written; made by `write_video`, which also ends and closes it.

    file: the open binary file to write to. size: (width, height) of all pictures in px, both even. fps: frames per
    second. quality: x264's constant rate factor, lower is better. State: libav's open container and stream.
    """

    def __init__(self, file: Any, size: tuple[int, int], fps: float, quality: int):
        import av

        self._container: Any = av.open(file, "w", format="mp4", options={"movflags": "faststart"})
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
        """Append a picture (H, W, 3) BGR uint8. Its size must be that of the video, which is not checked.

        A picture of another even size is scaled; an odd size raises cv2.error."""
        import av
        import cv2

        planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), np.uint8)
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        frame.color_range, frame.colorspace = NARROW, BT601
        self._container.mux(self._stream.encode(frame))

    def end(self) -> None:
        """Encode and write the frames that the encoder still holds; no picture may be added afterwards."""
        self._container.mux(self._stream.encode(None))

    def close(self) -> None:
        """Write the index of the file and close the container; the file object that was given stays open."""
        self._container.close()
