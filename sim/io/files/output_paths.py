"""Output paths: the only place where a name becomes a part of a path.

Names of sequences come from files of others (seqinfo.ini, manifests, suites). A name is a label: it says what something
is called, never where it is written. `file_name` turns any label into a name inside one folder.
"""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from scenarios.errors import InputError, is_control

LONGEST = 200  # bytes of a file name made from a label: 255 less temporary prefixes and our suffixes
FORBIDDEN = frozenset('/\\:*?"<>|')  # by Windows, or on network drives
RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)  # devices of Windows


def file_name(label: str) -> str:
    """Returns the file name for a label: the label itself if it is harmless on all usual systems, else a changed one.

    Different labels may give one name.
    """
    name = "".join("_" if _is_forbidden(c) else c for c in label)
    if name[:1] in ("", "."):
        name = "_" + name[1:]
    if name[-1] in (".", " "):
        name = name[:-1] + "_"
    if RESERVED.fullmatch(name):
        name = "_" + name
    body = name.encode()
    if len(body) <= LONGEST:
        return name
    digest = hashlib.sha256(label.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    return body[: LONGEST - 17].decode("utf-8", "ignore") + "-" + digest


def _is_forbidden(character: str) -> bool:
    return character in FORBIDDEN or is_control(character)


def output_path(folder: str | Path, label: str, ending: str = "") -> Path:
    """Returns the path of the file or folder for a label, directly inside `folder`; nothing is created."""
    return Path(folder) / (file_name(label) + ending)


def output_paths(folder: str | Path, labels: Iterable[str], ending: str = "", source: object = "") -> list[Path]:
    """Returns the `output_path` of each label; InputError, about `source`, if two labels give one path."""
    paths, seen = [], dict[str, str]()
    for label in labels:
        path = output_path(folder, label, ending)
        # Some file systems keep only one of two names that differ in case or in composed accents alone.
        key = unicodedata.normalize("NFC", path.name).casefold()
        if key in seen:
            both = f"the name {label!r} twice" if label == seen[key] else f"the names {seen[key]!r} and {label!r}"
            raise InputError(
                file=source, got=f"{both}, for one {path.name}", expected="unique names",
                remedy="rename one, or take one at a time",
            )  # fmt: skip
        seen[key] = label
        paths.append(path)
    return paths
