"""Seals the files of a run again after a change, as one who knows how could do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sim.store import tables
from sim.store.seal import NAMES, sealed_run


def seal_again(folder: Path, **changes: Any) -> None:
    """Names the files of the folder as they are now in its run.json, whose other keys get the `changes`."""
    info = {k: v for k, v in tables.read_json(folder / "run.json").items() if k not in ("files", "sha256")}
    files = {p.name: p.read_bytes() for p in folder.iterdir() if p.name in NAMES and p.name != "run.json"}
    (folder / "run.json").write_bytes(sealed_run({**info, **changes}, files))
