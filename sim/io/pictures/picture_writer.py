"""Writes the picture streams of a sequence, such as left and disparity, one picture at a time.

Each picture is drawn, its raw pixels are hashed, and it is encoded and written as a picture file or part of a video.
"""

from __future__ import annotations

import hashlib
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim import hashing
from sim.io.files import atomic
from sim.io.files.tables import Column, table_bytes
from sim.io.pictures.video_encoding import VideoWriter, write_video
from sim.io.store import streams
from sim.types import Frame, Image, PixelTruth, Sequence, Truth

JPG_QUALITY = 95
TABLE = "gt/pixels.parquet"
BOX = ("modal_left", "modal_top", "modal_width", "modal_height")

Facts = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class WrittenPictures:
    """What `write_pictures` wrote; all empty if nothing was."""

    streams: tuple[str, ...] = ()  # names of the streams
    images: str | None = None  # file type ("jpg", "png" or "mp4"), None if the streams leave no choice
    pixels: dict[str, str] = field(default_factory=dict)  # hash of the raw pixels by stream
    # {"sha256", "bytes"} of each file, by name relative to the sequence folder
    files: Facts = field(default_factory=dict)


NO_PICTURES = WrittenPictures()


class StreamWriter:
    """Writes one stream as picture files or as one video below `folder`; used as a context manager.

    State: the hash of the raw pixels so far, the open video if there is one, and {"sha256", "bytes"} of each complete
    file by name. A video is listed when the block ends without exception.
    """

    def __init__(self, folder: Path, stream: str, images: str, size: tuple[int, int], fps: float):
        self.stream, self.images, self.folder = stream, images, folder
        self.pixels, self.files = hashing.PixelHash(), Facts()
        self._open: AbstractContextManager[VideoWriter | None] = nullcontext()
        if streams.suffix(stream, images) == "mp4":
            self._open = write_video(folder / streams.file_name(stream, images, 1), size, fps)

    def add(self, picture: NDArray[Any]) -> None:
        """Writes the next picture: (H, W, 3) BGR uint8, or (H, W) uint16 for ids and disparity."""
        self.pixels.add(picture)
        if self._movie is not None:
            self._movie.add(picture)
            return
        name = streams.file_name(self.stream, self.images, self.pixels.count)
        body = encoded(picture, streams.suffix(self.stream, self.images))
        atomic.write_unsynced(self.folder / name, body)
        self.files[name] = {"sha256": hashing.file_hash(body), "bytes": len(body)}

    def __enter__(self) -> StreamWriter:
        self._movie = self._open.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._open.__exit__(*error)
        if self._movie is not None and error[0] is None:
            name = streams.file_name(self.stream, self.images, 1)
            with (self.folder / name).open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            self.files[name] = {"sha256": digest, "bytes": (self.folder / name).stat().st_size}


def encoded(picture: NDArray[Any], kind: str) -> bytes:
    """Returns a picture as the bytes of a file of type `kind`, "jpg" (quality 95) or "png"."""
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, JPG_QUALITY] if kind == "jpg" else []
    done, body = cv2.imencode(f".{kind}", picture, options)
    assert done
    return body.tobytes()


def write_pictures(folder: Path, sequence: Sequence, wanted: tuple[str, ...], images: str) -> WrittenPictures:
    """Draws the streams `wanted` of a sequence and writes them into a folder, one picture at a time.

    images: file type, "jpg", "png" or "mp4". gt/pixels.parquet is written if the sequence has exact pixels and truth.
    """
    if not wanted:
        return NO_PICTURES
    assert sequence.image_size is not None, "pictures have a size"
    known: list[PixelTruth] = []
    with ExitStack() as stack:
        form = (images, sequence.image_size, sequence.fps)
        outputs = {name: stack.enter_context(StreamWriter(folder, name, *form)) for name in wanted}
        if "background" in outputs:
            for picture in _background(sequence):
                outputs["background"].add(picture)
        seen = not outputs.keys().isdisjoint({"left", "right"})
        for frame in sequence if seen else sequence.without_pictures():
            _add(outputs, sequence, frame, known)
    files = {name: facts for output in outputs.values() for name, facts in output.files.items()}
    if known and sequence.truth is not None:
        body = pixel_table(sequence.truth, known)
        atomic.write_unsynced(folder / TABLE, body)
        files[TABLE] = {"sha256": hashing.file_hash(body), "bytes": len(body)}
    pixels = {name: output.pixels.hex() for name, output in outputs.items()}
    return WrittenPictures(wanted, streams.coding(wanted, images), pixels, files)


def _background(sequence: Sequence) -> Image:
    found = sequence.background()
    if found is None:
        raise _missing(sequence, "background")
    return found


def _add(outputs: dict[str, StreamWriter], sequence: Sequence, frame: Frame, known: list[PixelTruth]) -> None:
    for name, picture in (("left", frame.image), ("right", frame.right)):
        if name in outputs:
            if picture is None:
                raise _missing(sequence, name)
            outputs[name].add(picture)
    if sequence.load_pixels is None:
        if not outputs.keys().isdisjoint(streams.EXACT):
            raise _missing(sequence, "ids and disparity")
        return
    pixels = sequence.load_pixels(frame.index)
    if "ids" in outputs:
        outputs["ids"].add(streams.encode_ids(pixels.ids))
    if "disparity" in outputs:
        if pixels.disparity is None:
            raise _missing(sequence, "disparity")
        outputs["disparity"].add(streams.encode_disparity(pixels.disparity, sequence.camera))
    known.append(pixels.replace(ids=np.zeros((0, 0), np.int64), disparity=None))


def _missing(sequence: Sequence, stream: str) -> InputError:
    return InputError(
        file=sequence.name, place=f"--streams {stream}", got="a sequence without it",
        expected="a sequence with that stream", remedy="leave the stream out, or give its camera a baseline",
    )  # fmt: skip


def pixel_table(truth: Truth, known: list[PixelTruth]) -> bytes:
    """Returns the table of visible pixels, a row per person and frame in the order of the truth's rows.

    visible_px, amodal_px: pixels that show the person, and that would without occlusion; visibility_px: their ratio;
    modal_…: box of the visible pixels; blob: region of people who touch in the image, from 0 in each frame.
    """

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(pixels, name) for pixels in known])

    box = np.concatenate([pixels.box.reshape(-1, 4) for pixels in known])
    columns = [
        Column("frame", truth.frame),
        Column("id", truth.id),
        Column("visible_px", joined("visible_px"), "px²"),
        Column("amodal_px", joined("amodal_px"), "px²"),
        Column("visibility_px", joined("visibility")),
        *(Column(name, box[:, k], "px") for k, name in enumerate(BOX)),
        Column("blob", joined("blob")),
    ]
    return table_bytes(columns, {"frames": len(known)})
