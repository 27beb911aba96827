"""Recognises what users give in the place of tracks by mistake: a dataset, or a file that cannot hold tracks."""

from __future__ import annotations

from pathlib import Path

from scenarios.errors import InputError
from sim.io.store.manifest import is_sequence

OTHER_FILES = (".toml", ".py", ".json", ".ini", ".html", ".svg", ".jpg", ".png", ".mp4", ".xml")
"""Endings of files that hold no tracks."""

DATASET = ("", "*", "*/*")
"""Where a stored sequence lies below a sequence folder, a split of a dataset, or a dataset."""


def refuse_other_things(path: Path, expected: str) -> None:
    """Raises InputError if the path is a generated sequence or dataset, or a file that cannot hold tracks."""
    if path.is_file() and path.suffix.lower() in OTHER_FILES:
        raise InputError(
            file=path, got=f"a {path.suffix.lower()} file, no tracks", expected=expected, remedy="check the path"
        )
    folders = (folder for pattern in DATASET for folder in ([path] if not pattern else path.glob(pattern)))
    if path.is_dir() and any(is_sequence(folder) for folder in folders):
        raise InputError(
            file=path, got="a generated dataset, no tracks", expected=expected,
            remedy="give the --out of `flockscope track`",
        )  # fmt: skip
