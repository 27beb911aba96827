"""Video streams on loopback, each sent by a process of its own: `python -m tests.streams URL FRAMES …`."""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import av
import numpy as np

from tests.processes import ROOT

SIZE = (160, 120)
FPS = 25


def picture(k: int, size: tuple[int, int] = SIZE) -> np.ndarray:
    """The picture of frame k, from 0: a grey that tells the frame, as `frame_of` reads it."""
    return np.full((size[1], size[0], 3), 20 + 10 * (k % 20), np.uint8)


def frame_of(image: np.ndarray) -> int:
    """The frame modulo 20 of a decoded picture."""
    return round((float(image.mean()) - 20) / 10)


def send(
    target: Any, frames: Sequence[int], *, fps: int = FPS, size: tuple[int, int] = SIZE, format: str = "mpegts",
    paced: bool = False, sound: bool = False, stamps: Sequence[float] | None = None,
) -> None:  # fmt: skip
    """Writes these frames to a URL or file. stamps: times, s; None: frame / fps. paced: in the time that they last."""
    with av.open(target, "w", format=format) as container:
        if sound:
            stream = container.add_stream("aac", rate=48000)
            for k in range(100):
                samples = av.AudioFrame.from_ndarray(np.zeros((2, 1024), np.float32), "fltp", "stereo")
                samples.rate, samples.pts = 48000, 1024 * k
                container.mux(stream.encode(samples))
            container.mux(stream.encode())
            return
        stream = container.add_stream("mjpeg" if format == "mpjpeg" else "mpeg2video", rate=fps)
        stream.width, stream.height = size
        stream.pix_fmt = "yuvj420p" if format == "mpjpeg" else "yuv420p"
        stream.bit_rate = 2_000_000
        stream.codec_context.max_b_frames = 0
        begun = time.monotonic()
        for n, k in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(picture(k, size), "bgr24")
            for packet in stream.encode(frame):
                if stamps is not None:
                    packet.pts = packet.dts = round(stamps[n] / packet.time_base)
                container.mux(packet)
            if paced:
                time.sleep(max(0.0, begun + (n + 1) / fps - time.monotonic()))
        for packet in stream.encode():
            if stamps is not None:
                packet.pts = packet.dts = round(stamps[-1] / packet.time_base)
            container.mux(packet)


def sent(frames: Sequence[int], **options: Any) -> bytes:
    """The bytes that `send` writes."""
    file = BytesIO()
    send(file, frames, **options)
    return file.getvalue()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextmanager
def sender(port: int, frames: int, *words: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process that waits for one reader at tcp://127.0.0.1:port, sends it so many frames, and ends."""
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.streams", f"tcp://127.0.0.1:{port}?listen=1", str(frames), *words],
        cwd=ROOT, env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("url")
    parser.add_argument("frames", type=int)
    parser.add_argument("--paced", action="store_true")
    parser.add_argument("--first", type=int, default=0)
    args = parser.parse_args()
    send(args.url, range(args.first, args.first + args.frames), paced=args.paced)


if __name__ == "__main__":
    main()
