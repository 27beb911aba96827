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

from scenarios.errors import InputError
from scenarios.printable import is_control

LONGEST = 200  # bytes of a file name made from a label: 255 less temporary prefixes and our suffixes
FORBIDDEN = frozenset('/\\:*?"<>|')  # by Windows, or on network drives
RESERVED = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)  # devices of Windows


def file_name(label: str) -> str:
    """Return the file name for a label: the label itself if it is harmless, else a changed one.

    The result is one name inside a folder, on all usual file systems: 1 to 200 bytes of UTF-8, without separators, and
    not hidden. "_" replaces separators, control characters, characters that Windows forbids, a dot at the beginning, a
    dot or blank at the end, and the whole of an empty label. A device name of Windows (as "con") gets a "_" in front. A
    label of more than 200 bytes is cut and ends in 16 hex digits of its SHA-256. Different labels may give one name.
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
    """Return the path of the file or folder for a label, directly inside `folder`; nothing is created.

    Its name is `file_name(label)` and then `ending`, which is ours, as ".html" or "-s00001".
    """
    return Path(folder) / (file_name(label) + ending)


def output_paths(folder: str | Path, labels: Iterable[str], ending: str = "", source: object = "") -> list[Path]:
    """Return the path for each label, as `output_path`, in the order of the labels.

    source: where the labels come from, for the error. Raises InputError if two labels give one path. Names that differ
    in case or in composition of accents alone count as one, because some file systems keep only one of them.
    """
    paths, seen = [], dict[str, str]()
    for label in labels:
        path = output_path(folder, label, ending)
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
