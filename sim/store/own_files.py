"""Tells what a file is: ours, a stranger's of the same name, or a side file that an operating system put there.

JSON files of ours have keys that only we write, Parquet tables our metadata. Pages, PNG pictures, MP4 videos and the
first line of TOML files name the program that made them. Side files are ignored by readers of folders.

Output paths: the only place where a name becomes a part of a path.

Names of sequences come from files of others (seqinfo.ini, manifests, suites). A name is a label: it says what something
is called, never where it is written. `file_name` turns any label into a name inside one folder.
"""

from __future__ import annotations

import os.path
import re
import struct
import zlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path, PurePath
from urllib.parse import quote

from scenarios.errors import InputError, is_control, reject
from sim.store import tables

NAMES = frozenset({"__macosx", ".ds_store", "thumbs.db", "ehthumbs.db", "desktop.ini", "@eadir", "icon\r"})
APPLE_DOUBLE = "._"  # beginning of the files in which macOS keeps attributes on disks that cannot store them


def is_side_file(name: str | PurePath) -> bool:
    """Returns True if any part of a relative path is the name of a side file or folder of an operating system."""
    return any(part.startswith(APPLE_DOUBLE) or part.lower() in NAMES for part in PurePath(name).parts)


def is_hidden(path: PurePath) -> bool:
    """Returns True if readers ignore the file or folder: its own name begins with a dot or is that of a side file."""
    return path.name.startswith(".") or is_side_file(path.name)


GENERATOR = "flockscope"  # the name in the element <meta name="generator"> of a page, and in the comment of a video

HEAD = 1 << 16  # bytes of a page or picture in which our name stands
PAGE = f'<meta name="generator" content="{GENERATOR}">'.encode()

COMMENT = f"# {GENERATOR} ".encode()  # beginning of our TOML files

IHDR_END = 33  # bytes of a PNG file up to the end of its first chunk


TEXT = b"tEXtSoftware\0" + GENERATOR.encode()  # kind and content of the second chunk of our PNG files
SOFTWARE = struct.pack(">I", len(TEXT) - 4) + TEXT + struct.pack(">I", zlib.crc32(TEXT))


def marked_png(picture: bytes) -> bytes:
    """Returns the bytes of a PNG file, `picture`, with the name of flockscope added, by which `is_ours` knows it."""
    return picture[:IHDR_END] + SOFTWARE + picture[IHDR_END:]


# what names us in files of each suffix, and the size in bytes of the part that it is in
IN_HEAD = {".html": (PAGE, HEAD), ".png": (SOFTWARE, HEAD), ".toml": (COMMENT, len(COMMENT))}

# types of the values of keys that a .json file of ours always has, and no other program writes, by key
Marks = Mapping[str, type]


def is_ours(path: Path, marks: Marks | None = None) -> bool | None:
    """Returns True if flockscope wrote the file, False if not, None if it is missing or cannot be parsed.

    marks: keys that each of our .json files of this kind has, with the types of their values; None: no .json is ours.
    """
    if not path.is_file():
        return None
    try:
        if path.suffix == ".json" and marks:
            found = tables.read_json(path)
            return all(isinstance(found.get(key), kind) for key, kind in marks.items())
        if path.suffix in IN_HEAD:
            mark, size = IN_HEAD[path.suffix]
            with path.open("rb") as file:
                return mark in file.read(size)
        kinds = {".parquet": tables.is_own_table, ".mp4": _video}
        return path.suffix in kinds and kinds[path.suffix](path)
    except (InputError, OSError, ValueError):
        return None


def refuse_foreign_file(path: Path, marks: Marks | None = None, option: str = "--out") -> None:
    """Raises InputError if something is at `path` that flockscope did not write. marks: as for `is_ours`."""
    got, expected = "a file that flockscope did not write", "its own file, or none"
    foreign = path.exists() and not is_ours(path, marks)
    reject(foreign, path, got, expected, f"move it away, or choose another {option}")


def output_file(out: Path, suffix: str, option: str = "--out") -> Path:
    """Returns `out` if it is a file name with this suffix, and no .toml of others; else raises InputError."""
    wrong = out.is_dir() or out.suffix.lower() != suffix
    got, better = (f"{out}, a folder", out / "page") if out.is_dir() else (str(out), out.with_suffix(""))
    reject(wrong, "", got, f"a file that ends in {suffix}", f"write {better}{suffix}", option)
    if suffix == ".toml":  # Scenarios and parameters are written by hand, too.
        refuse_foreign_file(out)
    return out


def media_url(path: Path) -> str:
    """Returns the name by which libav opens a file, whatever its name: "12:30.mp4" alone would name a protocol."""
    return f"file:{path.absolute()}"


def _video(path: Path) -> bool:
    import av

    with suppress(av.FFmpegError), av.open(media_url(path), metadata_errors="ignore") as container:
        return container.metadata.get("comment") == GENERATOR
    return False


LONGEST = 200  # bytes of a file name made from a label: 255 less temporary prefixes and our suffixes
FORBIDDEN = frozenset('/\\:*?"<>|')  # by Windows, or on network drives


def file_name(label: str) -> str:
    """Returns the file name for a label: the label itself if usual systems allow it as a file name, else a changed one.

    Different labels may give one name.
    """
    name = "".join("_" if c in FORBIDDEN or is_control(c) else c for c in label)
    name = re.sub(r"^(\.|$)|[. ]$", "_", name)
    return name.encode()[:LONGEST].decode("utf-8", "ignore")


def output_path(folder: str | Path, label: str, ending: str = "") -> Path:
    """Returns the path of the file or folder for a label, directly inside `folder`; nothing is created."""
    return Path(folder) / (file_name(label) + ending)


def address(path: PurePath) -> str:
    """Returns a relative path as the address of a link, percent-encoded."""
    return quote(path.as_posix().encode("utf-8", "surrogateescape"))


def output_paths(folder: str | Path, labels: Iterable[str], ending: str = "", source: object = "") -> list[Path]:
    """Returns the `output_path` of each label; raises InputError, which names `source`, if two labels give one path."""
    paths, seen = [], dict[str, str]()
    for label in labels:
        path = output_path(folder, label, ending)
        key = path.name.casefold()  # some file systems keep only one of two names that differ in case alone
        if key in seen:
            both = f"the name {label!r} twice" if label == seen[key] else f"the names {seen[key]!r} and {label!r}"
            got = f"{both}, for one {path.name}"
            raise InputError(file=source, got=got, expected="unique names", remedy="rename one, or take one at a time")
        seen[key] = label
        paths.append(path)
    return paths


def split_and_name(folder: Path) -> str:
    """Returns <split>/<name>, the last two parts of a sequence folder's absolute path."""
    # ".." is resolved and links are not: the way to a folder does not change its name.
    return "/".join(Path(os.path.abspath(folder)).parts[-2:])
