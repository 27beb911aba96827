"""The picture streams of a sequence, such as left and disparity: writing them one by one, and reading them back.

Each picture is drawn, its raw pixels are hashed, and it is encoded and written as a picture file or part of a video.
When it is read, the bytes of its file are compared with their hash in manifest.json; a difference raises InputError.
The hash of the table of visible pixels is not checked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError, reject
from sim import hashing, streams
from sim.pictures import video_files
from sim.pictures.background_sample import BackgroundChoice, BackgroundSample
from sim.pictures.picture_folder import require_size
from sim.pictures.video_files import write_video
from sim.store import atomic
from sim.store.seal import REDO, check_file
from sim.store.tables import MODAL, read_table, table_bytes, units_of
from sim.types import BACKGROUNDS, OWN_BACKGROUND, Array, Frame, Image, Ints, PixelTruth, Sequence, Truth

JPG_QUALITY = 95
TABLE = "gt/pixels.parquet"


def encoded(picture: NDArray[Any], kind: str) -> bytes:
    """Returns a picture as the bytes of a file of type `kind`, "jpg" (quality 95) or "png"."""
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, JPG_QUALITY] if kind == "jpg" else []
    done, body = cv2.imencode(f".{kind}", picture, options)
    assert done
    return body.tobytes()


def write_pictures(folder: Path, sequence: Sequence, wanted: tuple[str, ...], images: str) -> dict[str, str]:
    """Draws the streams `wanted` of a sequence and writes them into a folder, one picture at a time.

    images: file type, "jpg", "png" or "mp4". gt/pixels.parquet is written if the sequence has exact pixels and truth.
    Returns the hash of the raw pixels of each stream.
    """
    if not wanted:
        return {}
    assert sequence.image_size is not None, "pictures have a size"
    known, hashes = list[PixelTruth](), {name: hashing.PixelHash() for name in wanted}
    with ExitStack() as stack:
        movies = {}
        for name in (name for name in wanted if streams.suffix(name, images) == "mp4"):
            video = write_video(folder / streams.file_name(name, images, 1), sequence.image_size, sequence.fps)
            movies[name] = stack.enter_context(video)

        def add(name: str, picture: NDArray[Any] | None) -> None:
            if picture is None:
                got, remedy = "a sequence without it", "leave the stream out, or give its camera a baseline"
                file, expected = sequence.name, "a sequence with that stream"
                raise InputError(file=file, place=f"--streams {name}", got=got, expected=expected, remedy=remedy)
            hashes[name].add(picture)
            if name in movies:
                movies[name].add(picture)
            else:
                body = encoded(picture, streams.suffix(name, images))
                atomic.write_inside(folder / streams.file_name(name, images, hashes[name].count), body)

        empty = sequence.background() if "background" in wanted else ()
        for picture in (None,) if empty is None else empty:
            add("background", picture)
        for frame in sequence if {"left", "right"} & hashes.keys() else sequence.without_pictures():
            pixels = None if sequence.load_pixels is None else sequence.load_pixels(frame.index)
            for name in (name for name in wanted if name != "background"):
                add(name, _picture(name, sequence, frame, pixels))
            if pixels is not None:
                known.append(pixels.replace(ids=np.zeros((0, 0), np.int64), disparity=None))
    if known and sequence.truth is not None:
        atomic.write_inside(folder / TABLE, pixel_table(sequence.truth, known))
    return {name: pixels.hex() for name, pixels in hashes.items()}


def _picture(name: str, sequence: Sequence, frame: Frame, pixels: PixelTruth | None) -> NDArray[Any] | None:
    """Returns a frame's picture of a stream; None without one."""
    if name == "ids" and pixels is not None:
        return streams.encode_ids(pixels.ids)
    if name == "disparity" and pixels is not None and pixels.disparity is not None:
        return streams.encode_disparity(pixels.disparity, sequence.camera)
    return {"left": frame.image, "right": frame.right}.get(name)


def pixel_table(truth: Truth, known: list[PixelTruth]) -> bytes:
    """Returns the content of gt/pixels.parquet: a row per person and frame, in the order of the truth's rows.

    known: the PixelTruth of each frame, which has the values. Columns: frame, id, visible_px, amodal_px, visibility_px
    (visible_px / amodal_px), modal_… (box of the visible pixels), blob.
    """

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(pixels, name) for pixels in known])

    box = np.concatenate([pixels.box.reshape(-1, 4) for pixels in known])
    columns = {
        "frame": truth.frame, "id": truth.id, "visible_px": joined("visible_px"), "amodal_px": joined("amodal_px"),
        "visibility_px": joined("visibility"), MODAL: box, "blob": joined("blob"),
    }  # fmt: skip
    return table_bytes(columns, {"frames": len(known)}, units_of("m"))


@dataclass(frozen=True)
class StoredPictures:
    """The pictures of a stored sequence, read when asked for."""

    folder: Path  # the sequence folder
    # the content of its manifest.json, with the stored streams ("left", "right", "disparity", "ids", "background") and
    # the hash of each file
    manifest: dict[str, Any]

    @property
    def streams(self) -> tuple[str, ...]:
        """The names of the stored streams."""
        return tuple(self.manifest["streams"])

    @property
    def images(self) -> str:
        """File type of the pictures; "png" if there are none, or only 16-bit streams (ids, disparity)."""
        return self.manifest.get("images") or "png"

    def check(self, name: str, whole: bool = False) -> bytes:
        """Raises InputError if a file differs from its hash in the manifest. Returns its bytes if `whole`, else b""."""
        path, files = self.folder / name, self.manifest["files"]
        reject(name not in files, path, "a manifest that does not name it", "a file that manifest.json names", REDO)
        return check_file(path, files[name], whole=whole)

    def one(self, stream: str, index: int) -> NDArray[Any]:
        """Returns picture `index` (from 1) of a stream of picture files: BGR, or uint16 codes of ids or disparity."""
        import cv2

        name = streams.file_name(stream, self.images, index)
        mode = cv2.IMREAD_UNCHANGED if stream in streams.EXACT else cv2.IMREAD_COLOR
        body = self.check(name, whole=True)
        picture = cv2.imdecode(np.frombuffer(body, np.uint8), mode) if body else None  # OpenCV refuses no bytes
        if picture is None or picture.dtype != (np.uint16 if stream in streams.EXACT else np.uint8):
            raise InputError(file=self.folder / name, got="no readable picture", expected="a picture", remedy=REDO)
        return require_size(picture, self.size, self.folder / name)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pictures, px."""
        width, height = self.manifest["sequence"]["image_size"]
        return width, height

    def all(self, stream: str, count: int, wanted: list[int] | None = None) -> Iterator[NDArray[Any]]:
        """Yields pictures 1 to `count` of a stream; wanted: only those of these numbers (from 1, ascending)."""
        if streams.suffix(stream, self.images) != "mp4":
            yield from (self.one(stream, k) for k in wanted or range(1, count + 1))
            return
        name, found = streams.file_name(stream, self.images, 1), 0
        path = self.folder / name
        self.check(name)
        frames = video_files.decode_frames(path, video_files.index_packets(path), wanted)
        for found, (_, picture) in enumerate(frames, 1):
            yield require_size(picture, self.size, path, f"frame {found}")
        reject(found != (count if wanted is None else len(wanted)), path, f"{found} pictures", count, REDO)

    def sample(self, wanted: list[int]) -> Iterable[tuple[int, Image]]:
        """Yields (frame, picture) of the left camera for the frames `wanted` (from 1, ascending)."""
        return zip(wanted, self.all("left", self.manifest["sequence"]["length"], wanted), strict=True)

    def background(self, choice: BackgroundChoice | None) -> tuple[Callable[[], Image] | None, dict[str, str]]:
        """Returns (loader of background pictures, entry for `Sequence.source`); (None, {}) if there are none."""
        if choice is None and "left" in self.streams and "background" not in self.streams:
            choice = BackgroundChoice()  # as of a recording
        if choice is not None:
            remedy = "leave it out: it has none"
            reject("left" not in self.streams, self.folder, "--background", "none for one without pictures", remedy)
            length = self.manifest["sequence"]["length"]
            fits = choice.of(length, self.folder, self.size)
            return BackgroundSample(fits, length, self.folder, self.sample), {"background": str(fits)}
        if "background" not in self.streams:
            return None, {}
        return (lambda: np.stack(list(self.all("background", BACKGROUNDS)))), {"background": OWN_BACKGROUND}

    def pixel_loader(self) -> Callable[[int], PixelTruth]:
        """Returns a function that gives the PixelTruth of a frame (from 1). The stream "ids" must be stored."""

        @cache
        def columns() -> tuple[Ints, Array, Array, Array, Ints]:
            table = read_table(self.folder / TABLE)
            counts = (table.floats("visible_px"), table.floats("amodal_px"))
            return table.ints("frame"), *counts, table.floats(*MODAL), table.ints("blob")

        def pixels(index: int) -> PixelTruth:
            frame, visible, amodal, box, blob = columns()
            rows = slice(*np.searchsorted(frame, (index, index + 1)).tolist())
            ids = streams.decode_ids(self.one("ids", index))
            known = "disparity" in self.streams
            disparity = streams.decode_disparity(self.one("disparity", index)) if known else None
            return PixelTruth(ids, disparity, visible[rows], amodal[rows], box[rows], blob[rows])

        return pixels
