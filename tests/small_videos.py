"""Small pictures and videos for tests: a disc that moves over a soft pattern, and files cut off or damaged."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

SIZE = (96, 64)


def picture(k: int, size: tuple[int, int] = SIZE) -> np.ndarray:
    """(H, W, 3) BGR: a white disc at u = 4 k; its blue tells k."""
    r = np.random.default_rng(0)
    base = cv2.GaussianBlur(r.integers(60, 180, (size[1], size[0], 3), dtype=np.uint8), (0, 0), 5)
    image = np.ascontiguousarray(base)
    cv2.circle(image, ((4 * k) % size[0], size[1] // 2), 8, (255, 255, 255), -1)
    return image


def disc(image: np.ndarray) -> float:
    """Where the disc is, u in px."""
    return float(np.nonzero((image > 225).all(axis=2))[1].mean())


def write_video(
    path: Path, pictures: Iterable[np.ndarray], rate: float = 10, codec: str = "libx264", pix_fmt: str = "yuv420p",
    audio: bool = False, rotation: int = 0, options: dict[str, str] | None = None, stamps: Iterable[int] | None = None,
    aspect: Fraction | None = None,
) -> Path:  # fmt: skip
    """A video; stamps: the frames' times in 1/1000 s instead of a steady rate. aspect: width / height of a pixel."""
    pictures = list(pictures)
    faststart = {"movflags": "faststart"} if path.suffix in (".mp4", ".mov") else {}
    with av.open(str(path), "w", options=faststart) as container:
        sound = container.add_stream("aac", rate=8000, layout="mono") if audio else None
        stream = container.add_stream(codec, rate=int(rate), options=options or {})
        stream.width, stream.height, stream.pix_fmt = pictures[0].shape[1], pictures[0].shape[0], pix_fmt
        if aspect is not None:
            stream.codec_context.sample_aspect_ratio = aspect
        if rotation:
            stream.set_display_rotation(rotation)
        if sound is not None:
            noise = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
            noise.sample_rate = 8000
            container.mux(sound.encode(noise))
        times = iter(stamps or ())
        for image in pictures:
            frame = av.VideoFrame.from_ndarray(image, format="gray" if image.ndim == 2 else "bgr24")
            if stamps is not None:
                frame.pts, frame.time_base = next(times), Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
        if sound is not None:
            container.mux(sound.encode(None))
    return path


def write_jpegs(path: Path, pictures: Iterable[np.ndarray]) -> Path:
    """An AVI of JPEGs, which may differ in size."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=10)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuvj420p"
        for k, image in enumerate(pictures):
            packet = av.Packet(cv2.imencode(".jpg", image)[1].tobytes())
            packet.stream, packet.pts, packet.dts, packet.time_base = stream, k, k, Fraction(1, 10)
            packet.is_keyframe = True
            container.mux(packet)
    return path


def cut(path: Path, share: float) -> Path:
    """The file without its end."""
    body = path.read_bytes()
    path.write_bytes(body[: int(share * len(body))])
    return path


def damage(path: Path, share: float, n: int = 200) -> Path:
    """The file with n bytes of noise in it."""
    body = bytearray(path.read_bytes())
    at = int(share * len(body))
    body[at : at + n] = np.random.default_rng(1).integers(0, 255, n, dtype=np.uint8).tobytes()
    path.write_bytes(bytes(body))
    return path
