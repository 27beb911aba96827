"""Recordings of others, written by hand: a folder as MOTChallenge has it, and a short walk as BIWI has it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np


def mot_folder(
    folder: Path, gt: str | None = None, det: str | None = None, ini: str | None = None,
    pictures: Mapping[str, np.ndarray] | None = None,
) -> Path:  # fmt: skip
    """Labels, detections, lines of seqinfo.ini, and pictures by their names below the folder; None for no such file."""
    for name, text in (("gt/gt.txt", gt), ("det/det.txt", det), ("seqinfo.ini", ini and f"[Sequence]\n{ini}")):
        if text is not None:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(text, encoding="utf-8")
    for name, picture in (pictures or {}).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(cv2.imencode(Path(name).suffix, picture)[1].tobytes())
    return folder


def biwi_walk(folder: Path) -> Path:
    """Two people, one group, walk beside each other for 8 s."""
    folder.mkdir(parents=True)
    rows = [f"{10 * k} {person} {0.5 * k} 0 {person}.0 0 0 0\n" for k in range(20) for person in (1, 2)]
    (folder / "obsmat.txt").write_text("".join(rows))
    (folder / "groups.txt").write_text("1 2\n")
    return folder
