"""Pictures of a stored sequence, read when asked for and require_size against the manifest."""

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
    """The pictures of a sequence's folder, as its manifest tells."""

    folder: Path
    manifest: dict[str, Any]

    @property
    def streams(self) -> tuple[str, ...]:
        """Those that are there."""
        return tuple(self.manifest["streams"])

    @property
    def images(self) -> str:
        """jpg, png or mp4."""
        return self.manifest.get("images") or "png"

    def body(self, name: str) -> bytes:
        """A file's bytes; InputError where it is missing or not the one of the manifest."""
        path, facts = self.folder / name, self.manifest["files"].get(name)
        wanted = "a file that manifest.json names" if facts is None else f"the {facts['bytes']} bytes of manifest.json"
        try:
            body = path.read_bytes()
        except OSError:
            raise InputError(file=path, got="missing", expected=wanted, remedy=REDO) from None
        if facts is None or hashing.file_hash(body) != facts["sha256"]:
            raise InputError(file=path, got=f"altered: {len(body)} bytes", expected=wanted, remedy=REDO)
        return body

    def one(self, stream: str, index: int) -> NDArray[Any]:
        """The picture of one file: (H, W, 3) uint8, or (H, W) uint16 of an exact stream."""
        import cv2

        name = streams.file_name(stream, self.images, index)
        mode = cv2.IMREAD_UNCHANGED if stream in streams.EXACT else cv2.IMREAD_COLOR
        picture = cv2.imdecode(np.frombuffer(self.body(name), np.uint8), mode)
        if picture is None or picture.dtype != (np.uint16 if stream in streams.EXACT else np.uint8):
            raise InputError(file=self.folder / name, got="no readable picture", expected="one", remedy=REDO)
        return require_size(picture, self._size, self.folder / name)

    @property
    def _size(self) -> tuple[int, int]:
        width, height = self.manifest["sequence"]["image_size"]
        return width, height

    def all(self, stream: str, count: int, wanted: list[int] | None = None) -> Iterator[NDArray[Any]]:
        """The pictures of a stream that has so many, in order; or those wanted (ascending)."""
        if streams.suffix(stream, self.images) != "mp4":
            yield from (self.one(stream, k) for k in wanted or range(1, count + 1))
            return
        name = streams.file_name(stream, self.images, 1)
        self.body(name)
        path, found = self.folder / name, 0
        for found, (_, picture) in enumerate(
            video_decoding.decode_frames(path, video_decoding.index_packets(path), wanted), 1
        ):
            yield require_size(picture, self._size, path, f"frame {found}")
        if found != (count if wanted is None else len(wanted)):
            raise InputError(file=path, got=f"{found} pictures", expected=count, remedy=REDO)

    def sample(self, wanted: list[int]) -> Iterable[tuple[int, Image]]:
        """(frame, picture) of some frames of the left camera."""
        return zip(wanted, self.all("left", self.manifest["sequence"]["length"], wanted), strict=True)

    def table(self) -> StoredTable:
        """Who shows how much, where, and in which blob."""
        return read_table(self.folder / TABLE)

    def pixel_loader(self) -> Callable[[int], PixelTruth]:
        """A function from a frame to its exact pixels; disparities to 1/128 px."""

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
