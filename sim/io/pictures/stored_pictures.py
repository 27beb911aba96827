"""Reads the pictures of a stored sequence one by one, and from them the truth of the pixels.

The bytes of each picture file are compared with their hash in the sequence's manifest.json; a difference raises
InputError. The hash of the table of visible pixels is not checked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.errors import InputError
from sim import hashing
from sim.io.files.tables import StoredTable, read_table
from sim.io.pictures import video_decoding
from sim.io.pictures.picture_folder import require_size
from sim.io.pictures.picture_writer import BOX, TABLE
from sim.io.store import streams
from sim.io.store.manifest import REDO
from sim.types import Array, Image, Ints, PixelTruth


@dataclass(frozen=True)
class StoredPictures:
    """The pictures of a stored sequence, read when asked for."""

    folder: Path  # the sequence folder
    # the content of its manifest.json, with the stored streams ("left", "right", "disparity", "ids", "background") and
    # the hash of each file
    manifest: dict[str, Any]

    @property
    def streams(self) -> tuple[str, ...]:
        """The stored streams."""
        return tuple(self.manifest["streams"])

    @property
    def images(self) -> str:
        """File type of the pictures; "png" without pictures or with 16-bit streams only."""
        return self.manifest.get("images") or "png"

    def body(self, name: str) -> bytes:
        """Returns the bytes of a file; raises InputError if they are not those that the manifest names."""
        path, facts = self.folder / name, self.manifest["files"].get(name)
        wanted = "a file that manifest.json names" if facts is None else f"the {facts['bytes']} bytes of manifest.json"
        try:
            size = path.stat().st_size if path.is_file() else None  # a FIFO would block its reader
            body = path.read_bytes() if size is not None and facts is not None and size == facts["bytes"] else b""
        except OSError:
            size = None
        if size is None:
            raise InputError(file=path, got="missing", expected=wanted, remedy=REDO)
        if facts is None or size != facts["bytes"] or hashing.file_hash(body) != facts["sha256"]:
            raise InputError(file=path, got=f"altered: {size} bytes", expected=wanted, remedy=REDO)
        return body

    def one(self, stream: str, index: int) -> NDArray[Any]:
        """Returns picture `index` (from 1) of a stream of picture files: BGR, or codes of ids and disparity."""
        import cv2

        name = streams.file_name(stream, self.images, index)
        mode = cv2.IMREAD_UNCHANGED if stream in streams.EXACT else cv2.IMREAD_COLOR
        body = self.body(name)
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
        """Yields the pictures 1 to `count` of a stream, or only the numbers `wanted` (ascending, from 1)."""
        if streams.suffix(stream, self.images) != "mp4":
            yield from (self.one(stream, k) for k in wanted or range(1, count + 1))
            return
        name = streams.file_name(stream, self.images, 1)
        self.body(name)
        path, found = self.folder / name, 0
        for found, (_, picture) in enumerate(
            video_decoding.decode_frames(path, video_decoding.index_packets(path), wanted), 1
        ):
            yield require_size(picture, self.size, path, f"frame {found}")
        if found != (count if wanted is None else len(wanted)):
            raise InputError(file=path, got=f"{found} pictures", expected=count, remedy=REDO)

    def sample(self, wanted: list[int]) -> Iterable[tuple[int, Image]]:
        """Returns (frame, picture) of the left camera for the frames `wanted` (from 1, ascending)."""
        return zip(wanted, self.all("left", self.manifest["sequence"]["length"], wanted), strict=True)

    def table(self) -> StoredTable:
        """Returns the table of visible pixels (`pixel_table`)."""
        return read_table(self.folder / TABLE)

    def pixel_loader(self) -> Callable[[int], PixelTruth]:
        """Returns a function that maps a frame (from 1) to its PixelTruth; the stream ids is stored."""

        @cache
        def columns() -> tuple[Ints, Array, Array, Array, Ints]:
            table = self.table()
            counts = (table.floats("visible_px"), table.floats("amodal_px"))
            return table.ints("frame"), *counts, table.floats(*BOX), table.ints("blob")

        def pixels(index: int) -> PixelTruth:
            frame, visible, amodal, box, blob = columns()
            rows = slice(*np.searchsorted(frame, (index, index + 1)).tolist())
            ids = streams.decode_ids(self.one("ids", index))
            known = "disparity" in self.streams
            disparity = streams.decode_disparity(self.one("disparity", index)) if known else None
            return PixelTruth(ids, disparity, visible[rows], amodal[rows], box[rows], blob[rows])

        return pixels
