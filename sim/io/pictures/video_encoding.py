"""Writing H.264 that browsers play and seek in: mp4, yuv420p, a key frame each second, the index in front.

One thread and no dates: the same pictures give the same bytes.
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

QUALITY = 18  # x264's constant rate factor: hardly to be told from the original
BT601, NARROW = 6, 1  # libav's numbers of the colour matrix and range that OpenCV converts to


def rate_of(fps: float) -> Fraction:
    """Frames per second as containers have them."""
    return Fraction(fps).limit_denominator(1001)


@contextmanager
def write_video(path: Path, size: tuple[int, int], fps: float, quality: int = QUALITY) -> Iterator[VideoWriter]:
    """A video file of pictures of this size (width, height) to write; it is whole when left without an error."""
    if size[0] % 2 or size[1] % 2:
        raise InputError(
            place="--images mp4", got="pictures of {}×{} px".format(*size), expected="an even width and height",
            remedy="take --images jpg or png, or another camera.image",
        )  # fmt: skip
    # The file is ours, as libav keeps its own open where a video cannot be ended; and it is without Python code, which
    # Ctrl-C would end unseen in a callback of libav.
    with path.open("wb", buffering=0) as file:
        made = VideoWriter(file, size, fps, quality)
        try:
            yield made
            made.end()
        finally:
            made.close()


class VideoWriter:
    """A video that takes (H, W, 3) BGR pictures one after the other; see `movie`."""

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
        """The next picture."""
        import av
        import cv2

        planes = np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420), np.uint8)
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        frame.color_range, frame.colorspace = NARROW, BT601
        self._container.mux(self._stream.encode(frame))

    def end(self) -> None:
        """Nothing comes any more."""
        self._container.mux(self._stream.encode(None))

    def close(self) -> None:
        """Write what is left, and where it lies."""
        self._container.close()
