"""Positions of people on the ground in m as other programs read them: TrajNet++, and PedPy's and JuPedSim's text.

TrajNet++: a JSON object in each line; a scene for each person, from the first to the last frame, with the frame rate,
then a track for each person and frame. PedPy and JuPedSim: lines `id frame x y`, apart by tabs, below comments with the
frame rate and the names of the columns.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Literal

import numpy as np

from scenarios.errors import InputError
from sim.io.export.tidy_tables import TidyTables
from sim.io.files.atomic import write_file
from sim.io.files.own_files import refuse_foreign_file

TextForm = Literal["trajnet", "pedpy"]
NAMES = {"trajnet": "people.ndjson", "pedpy": "people.txt"}
# of the texts written here; a text without people may be empty
BEGINNINGS = {
    "trajnet": re.compile(rb'\{"scene": \{"id": 0, "p": \d+, "s": \d+, "e": \d+, "fps": [^}]*\}\}\n|\Z'),
    "pedpy": re.compile(rb"# framerate: \S+\n# id\tframe\tx/m\ty/m\n"),
}


def write_text(tables: TidyTables, folder: Path, form: TextForm, fps: float) -> list[Path]:
    """Writes the people of tables into the folder and returns the path.

    Raises InputError if they are in the image, or a file of another program is in the way.
    """
    columns = tables.people.columns
    if "x_m" not in columns:
        raise InputError(
            file=folder, got="people in the image, px", expected="positions on the ground, m",
            remedy="track with --camera, or from points",
        )  # fmt: skip
    rows = list(zip(*(columns[name].tolist() for name in ("frame", "id", "x_m", "y_m")), strict=True))
    path = folder / NAMES[form]
    if path.exists() and not (path.is_file() and _is_own(path, form)):
        refuse_foreign_file(path)
    write_file(path, (_trajnet(tables, rows, fps) if form == "trajnet" else _pedpy(rows, fps)).encode())
    return [path]


def _is_own(path: Path, form: TextForm) -> bool:
    with path.open("rb") as file:
        return BEGINNINGS[form].match(file.read(1000)) is not None


def _trajnet(tables: TidyTables, rows: list[tuple[int, int, float, float]], fps: float) -> str:
    stays = tables.people_summary.columns
    spans = zip(*(np.asarray(stays[name]).tolist() for name in ("id", "start_frame", "end_frame")), strict=True)
    scenes = [
        {"scene": {"id": k, "p": p, "s": first, "e": last, "fps": fps}} for k, (p, first, last) in enumerate(spans)
    ]
    tracks = [{"track": {"f": f, "p": p, "x": round(x, 4), "y": round(y, 4)}} for f, p, x, y in rows]
    return "".join(json.dumps(line) + "\n" for line in [*scenes, *tracks])


def _pedpy(rows: list[tuple[int, int, float, float]], fps: float) -> str:
    head = f"# framerate: {fps:g}\n# id\tframe\tx/m\ty/m\n"
    return head + "".join(f"{p}\t{f}\t{x:.4f}\t{y:.4f}\n" for f, p, x, y in rows)
