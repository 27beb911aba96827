"""Tells what a file is: ours, a stranger's of the same name, or a side file that an operating system put there.

JSON files of ours have keys that only we write, Parquet tables our metadata. Pages, PNG pictures and MP4 videos name
the program that made them. Side files are ignored by readers of folders.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path, PurePath

from scenarios.errors import InputError
from sim.io.files import tables

NAMES = frozenset({"__macosx", ".ds_store", "thumbs.db", "ehthumbs.db", "desktop.ini", "@eadir", "icon\r"})
APPLE_DOUBLE = "._"  # beginning of the files in which macOS keeps attributes on disks that cannot store them


def is_side_file(name: str | PurePath) -> bool:
    """Returns True if a part of a relative path is the name of a side file or folder."""
    return any(part.startswith(APPLE_DOUBLE) or part.lower() in NAMES for part in PurePath(name).parts)


def is_hidden(path: PurePath) -> bool:
    """Returns True if readers ignore the file or folder: its own name begins with a dot or is that of a side file."""
    return path.name.startswith(".") or is_side_file(path.name)


GENERATOR = "flockscope"  # the name in the element <meta name="generator"> of a page, and in the comment of a video

HEAD = 1 << 16  # bytes of a page in which its generator stands

IHDR_END = 33  # bytes of a PNG file up to the end of its first chunk


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


SOFTWARE = _chunk(b"tEXt", b"Software\0" + GENERATOR.encode())  # the second chunk of our PNG files


def marked_png(picture: bytes) -> bytes:
    """Returns a PNG file's bytes with the name of our program in it."""
    return picture[:IHDR_END] + SOFTWARE + picture[IHDR_END:]


# types of the values of keys that a .json file of ours always has, and no other program writes, by key
Marks = Mapping[str, type]


def is_ours(path: Path, marks: Marks | None = None) -> bool | None:
    """Returns True if flockscope wrote the file, False if not, None if it is missing or cannot be parsed.

    marks: of a .json file.
    """
    if not path.is_file():
        return None
    try:
        if path.suffix == ".json" and marks:
            found = tables.read_json(path)
            return all(isinstance(found.get(key), kind) for key, kind in marks.items())
        kinds = {".parquet": tables.is_own_table, ".html": _page, ".png": _picture, ".mp4": _video}
        return path.suffix in kinds and kinds[path.suffix](path)
    except (InputError, OSError, ValueError):
        return None


def refuse_foreign_file(path: Path, marks: Marks | None = None) -> None:
    """Raises InputError if there is a file at `path` that is not ours: only our own files are replaced unasked."""
    if path.exists() and not is_ours(path, marks):
        raise InputError(
            file=path, got="a file that flockscope did not write", expected="its own file, or none",
            remedy="move it away, or choose another --out",
        )  # fmt: skip


def _page(path: Path) -> bool:
    with path.open("rb") as file:
        return f'<meta name="generator" content="{GENERATOR}">'.encode() in file.read(HEAD)


def _picture(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(IHDR_END + len(SOFTWARE))[IHDR_END:] == SOFTWARE


def _video(path: Path) -> bool:
    import av

    try:
        with av.open(str(path), metadata_errors="ignore") as container:
            return container.metadata.get("comment") == GENERATOR
    except av.FFmpegError:
        return False
