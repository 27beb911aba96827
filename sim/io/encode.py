"""Writing H.264 that browsers play and seek in: mp4, yuv420p, a key frame each second, the index in front.

One thread and no dates: the same pictures give the same bytes.
"""

from __future__ import annotations

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


class Movie:
    """A video file that takes (H, W, 3) BGR pictures one after the other; a context manager, whole when left."""

    def __init__(self, path: Path, size: tuple[int, int], fps: float, quality: int = QUALITY):
        import av

        if size[0] % 2 or size[1] % 2:
            raise InputError(
                place="--images mp4", got="pictures of {}×{} px".format(*size), expected="an even width and height",
                remedy="take --images jpg or png, or another camera.image",
            )  # fmt: skip
        rate = rate_of(fps)
        self._file = _File(path)
        self._container: Any = av.open(self._file, "w", format="mp4", options={"movflags": "faststart"})
        group = str(max(1, round(fps)))
        options = {"crf": str(quality), "preset": "veryfast", "g": group, "bf": "2", "threads": "1"}
        self._stream: Any = self._container.add_stream("libx264", rate=rate, options=options)
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
        self._file.check()

    def __enter__(self) -> Movie:
        return self

    def __exit__(self, *error: object) -> None:
        try:
            if error[0] is None:
                self._container.mux(self._stream.encode(None))
        finally:
            try:
                self._container.close()
            finally:
                self._file.close()
                if error[0] is None:
                    self._file.check()


class _File:
    """What libav writes to, which keeps its own files open where it cannot end a video. State: the first refusal of the
    disk, after which all goes nowhere."""

    def __init__(self, path: Path):
        self.name, self._raw = str(path), path.open("wb", buffering=0)
        self._error: OSError | None = None
        self.seek, self.tell, self.close = self._raw.seek, self._raw.tell, self._raw.close

    def write(self, body: bytes) -> int:
        """All of it, or nothing any more."""
        rest = memoryview(body)
        try:
            while len(rest) and self._error is None:
                rest = rest[self._raw.write(rest) :]
        except OSError as error:
            self._error = error
        return len(body)

    def check(self) -> None:
        """Raise what the disk refused."""
        if self._error is not None:
            raise self._error
