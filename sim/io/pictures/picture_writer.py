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
    """What `write_pictures` wrote; all empty if nothing was.

    streams: names of the streams. images: file type ("jpg", "png" or "mp4"), None if the streams leave no choice.
    pixels: hash of the raw pixels by stream. files: {"sha256", "bytes"} of each file, by name relative to the sequence
    folder.
    """

    streams: tuple[str, ...] = ()
    images: str | None = None
    pixels: dict[str, str] = field(default_factory=dict)
    files: Facts = field(default_factory=dict)


NO_PICTURES = WrittenPictures()


class StreamWriter:
    """Writes one stream as picture files or as one video below `folder`; used as a context manager.

    stream: its name, "left", "right", "disparity", "ids" or "background". images: file type, "jpg", "png" or "mp4"
    (disparity and ids are always PNG). size: (width, height) in px; fps: frames/s; both for a video only. State: the
    hash of the raw pixels so far (`pixels`), the open video if there is one, and `files`: {"sha256", "bytes"} of each
    complete file, by name relative to `folder`. A video is listed when the block ends without exception. Entering the
    block raises InputError if a video's width or height is odd, OSError if it cannot be opened.
    """

    def __init__(self, folder: Path, stream: str, images: str, size: tuple[int, int], fps: float):
        self.stream, self.images, self.folder = stream, images, folder
        self.pixels, self.files = hashing.PixelHash(), Facts()
        self._open: AbstractContextManager[VideoWriter | None] = nullcontext()
        if streams.suffix(stream, images) == "mp4":
            self._open = write_video(folder / streams.file_name(stream, images, 1), size, fps)

    def add(self, picture: NDArray[Any]) -> None:
        """Write the next picture of the stream: (H, W, 3) BGR uint8, or (H, W) uint16 for the streams ids and
        disparity.

        Frames count from 1 in the order of the calls. It also adds to `pixels`, and to `files` unless the stream is a
        video. Raises OSError if the file cannot be written.
        """
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
    """Return a picture as the bytes of a file of type `kind`: "jpg" (quality 95) or "png" (lossless).

    picture: (H, W, 3) BGR uint8, or (H, W) uint16 for "png" only. Raises cv2.error for a picture or type that OpenCV
    cannot encode.
    """
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, JPG_QUALITY] if kind == "jpg" else []
    done, body = cv2.imencode(f".{kind}", picture, options)
    assert done
    return body.tobytes()


def write_pictures(folder: Path, sequence: Sequence, wanted: tuple[str, ...], images: str) -> WrittenPictures:
    """Draw the streams `wanted` of a sequence and write them into a folder; returns what was written.

    wanted: some of "left", "right", "disparity", "ids", "background". One picture per stream is in memory at a time.
    images: file type, "jpg", "png" or "mp4". If the sequence has exact pixels and truth, gt/pixels.parquet is written
    too. An empty `wanted` writes nothing. The sequence needs an image size, else AssertionError.

    Raises InputError if the sequence lacks a stream, or its width or height is odd for "mp4"; WorkError if the stream
    ids has a person id above 999; OSError if a file cannot be written. Also raises what drawing raises.
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
    """Add one frame to each open stream (`outputs`, by name), and append its PixelTruth without the images to `known`.

    `known` is changed; it stays as it is for a sequence without exact pixels. The stream "background" gets nothing.
    Raises InputError if the sequence lacks a stream, WorkError if the stream ids has a person id above 999 or a
    disparity is 256 px or more, OSError if a file cannot be written.
    """
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
    """Return the table of visible pixels as Parquet bytes: one row per person and frame, in the order of the truth's
    rows.

    known: the PixelTruth of every frame, from frame 1, at least one (else ValueError). Columns: frame (from 1), id,
    visible_px and amodal_px (numbers of pixels that show the person, and that would without occlusion), visibility_px
    (their ratio, 0 for 0 of 0), modal_left, modal_top, modal_width, modal_height (px; box of the visible pixels, nan if
    hidden), blob (number, from 0 in each frame, of the region of people who touch in the image, -1 if hidden).
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
