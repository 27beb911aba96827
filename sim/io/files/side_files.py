"""Side files: what operating systems and archive programs put beside the files of users. Readers of folders ignore
them."""

from __future__ import annotations

from pathlib import PurePath

NAMES = frozenset({"__macosx", ".ds_store", "thumbs.db", "ehthumbs.db", "desktop.ini", "@eadir", "icon\r"})
APPLE_DOUBLE = "._"  # beginning of the files in which macOS keeps attributes on disks that cannot store them


def is_side_file(name: str | PurePath) -> bool:
    """Returns True if a part of a relative path is the name of a side file or folder."""
    return any(part.startswith(APPLE_DOUBLE) or part.lower() in NAMES for part in PurePath(name).parts)


def is_hidden(path: PurePath) -> bool:
    """Returns True if readers ignore the file or folder: its own name begins with a dot or is that of a side file."""
    return path.name.startswith(".") or is_side_file(path.name)
