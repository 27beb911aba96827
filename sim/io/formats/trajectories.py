"""Reader for texts of trajectories on the ground in m: TrajNet++, four columns as of ETH and UCY, PedPy and JuPedSim.

TrajNet++ (*.ndjson) has a JSON object a line: {"scene": {…, "fps": 2.5}} or {"track": {"f", "p", "x", "y"}}. ETH and
UCY texts, as Social GAN and others distribute them, have `frame id x y`, separated by tabs or blanks, at 2.5 per s. In
both, frames are numbers of video frames in steps, and are counted from 1 as in BIWI. PedPy and JuPedSim texts have
lines `id frame x y z …` below comments: one states the rate, `# framerate: 8.00`, and one may state cm, as `x/cm`.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE, DETECTIONS, FRAME_RATES, FRAMES, is_number
from scenarios.reading import parse_json
from sim.io.files.numeric_text import NumericTable, crowded, is_number_text, read_numbers, read_text
from sim.io.formats.biwi import frame_numbers
from sim.io.formats.labels import require_size
from sim.io.formats.mot_table import MotTable
from sim.io.formats.mot_text import sequence_of_table
from sim.io.formats.options import NO_OPTIONS, RecordingOptions
from sim.types import Sequence

NDJSON = ".ndjson"
ETH_FPS = 2.5
CORRECT = "correct or remove the line"
FRAMERATE = re.compile(r"framerate\W+([0-9.]+)", re.IGNORECASE)
PEDPY = re.compile(r"#.*framerate|#\s*(id|persid)\s+(frame|fr)\b", re.IGNORECASE)


def is_trajectories(path: Path) -> bool:
    """Returns True if a text is one of these: by its ending, its comments, or four numbers apart by blanks."""
    if path.suffix.lower() == NDJSON:
        return True
    lines = [line for line in islice(read_text(path).splitlines(), 1000) if line.strip()]
    comments = [line for line in lines if line.startswith("#")]
    if comments:
        return any(PEDPY.match(line) for line in comments)
    cells = lines[0].split() if lines else []
    return len(cells) == 4 and all(map(is_number_text, cells))


def open_text(path: Path, options: RecordingOptions = NO_OPTIONS) -> Sequence:
    """Returns a text of trajectories as Sequence with truth, without pictures and detections."""
    rows, rate = _read(path, options.fps)
    return sequence_of_table(_table(rows), path, rate, "trajectories")


def _read(path: Path, fps: float | None) -> tuple[NumericTable, float]:
    """Returns the rows `frame, id, x, y`, frames from 1, x and y in m, and the frame rate; fps: that of the user."""
    if path.suffix.lower() == NDJSON:
        rows, stated = _read_ndjson(path)
    elif read_text(path).lstrip().startswith("#"):
        return _read_pedpy(path, fps)
    else:
        rows, stated = read_numbers(path, (4, 4), layout="frame id x y"), None
    _require_rows(rows)
    rate = fps or stated
    if rate is None:
        text = f"trajectories without a frame rate are taken at {ETH_FPS:g} fps, as ETH and UCY (--fps says otherwise)"
        warnings.warn(text, stacklevel=4)
    raw, id = rows.integers(0, "frame"), rows.integers(1, "id")
    return _with_frames(rows, frame_numbers(raw, id)), rate or ETH_FPS


def _require_rows(rows: NumericTable) -> None:
    if not len(rows.line):
        raise InputError(file=rows.file, got="no row", expected="people with frame, id, x and y", remedy="restore it")


def _with_frames(rows: NumericTable, frame: Any) -> NumericTable:
    return replace(rows, values=np.column_stack([frame, rows.values[:, 1:]]))


def _read_pedpy(path: Path, fps: float | None) -> tuple[NumericTable, float]:
    comments = [line for line in read_text(path).splitlines() if line.startswith("#")]
    rates = [found[1] for line in comments if (found := FRAMERATE.search(line))]
    rate = fps or (float(rates[0]) if rates and is_number_text(rates[0]) else None)
    if rate is None or not is_number(rate, *FRAME_RATES):
        expected = "frames per second from {:g} to {:g}".format(*FRAME_RATES)
        got = rates[0] if rates else "none"
        raise InputError(file=path, place="# framerate", got=got, expected=expected, remedy="correct it, or give --fps")
    rows = read_numbers(path, (4, 12), layout="id frame x y z", comments=True)
    _require_rows(rows)
    raw = rows.integers(1, "frame")
    scale = 0.01 if any("x/cm" in line for line in comments) else 1.0
    ordered = replace(rows, values=np.column_stack([rows.values[:, (1, 0)], scale * rows.values[:, 2:4]]))
    return _with_frames(ordered, raw - raw.min() + 1), rate


def _read_ndjson(path: Path) -> tuple[NumericTable, float | None]:
    rows, lines, rates = [], [], set[float]()
    for number, line in enumerate(read_text(path).splitlines(), 1):
        if not line.strip():
            continue
        track, rate = _json_row(path, number, line)
        if track is not None:
            rows.append(track)
            lines.append(number)
        elif rate is not None:
            rates.add(rate)
            if len(rates) > 1:
                raise _bad(path, number, f"fps {rate:g}", f"{min(rates - {rate}):g}, as in earlier scenes")
    values = np.array(rows, np.float64).reshape(-1, 4)
    return NumericTable(path, values, np.array(lines, np.int64), "f, p, x, y"), next(iter(rates), None)


def _json_row(path: Path, number: int, line: str) -> tuple[list[float] | None, float | None]:
    """Returns (frame, person, x, y) of a line with a track, or the frame rate of one with a scene."""
    try:
        value = parse_json(line, path)
    except InputError as error:
        raise _bad(path, number, error.got, "a JSON object") from None
    match value:
        case {"track": {"f": f, "p": p, "x": x, "y": y}} if all(_finite(v) for v in (f, p, x, y)):
            return [float(v) for v in (f, p, x, y)], None
        case {"scene": {"fps": fps}} if is_number(fps, *FRAME_RATES):
            return None, float(fps)
        case {"scene": dict() as scene} if "fps" not in scene:
            return None, None
    raise _bad(path, number, line.strip()[:80], '{"track": {"f", "p", "x", "y"}} of numbers, or {"scene": {…, "fps"}}')


def _finite(value: object) -> bool:
    return is_number(value, -(2**52), 2**52)


def _bad(path: Path, number: int, got: object, expected: str) -> InputError:
    return InputError(file=path, place=f"line {number}", got=got, expected=expected, remedy=CORRECT)


def _table(rows: NumericTable) -> MotTable:
    """Returns the rows as those of a text of positions without boxes."""
    frame, id, count = rows.integers(0, "frame"), rows.integers(1, "id"), len(rows.line)
    rows.reject(id < 0, "ids from 0", "correct the id")
    rows.reject(frame > FRAMES, f"at most {FRAMES} frames", "correct the frame")
    rows.reject(crowded(frame), f"at most {DETECTIONS} people in a frame", CORRECT)
    rows.reject((np.abs(rows.values[:, 2:]) > COORDINATE).any(axis=1), f"numbers within {COORDINATE:g}", CORRECT)
    require_size(rows.file, int(frame.max()), id)
    rest = np.column_stack([np.ones(count), rows.values[:, 2:], np.zeros(count)])
    return MotTable(rows, frame, id, np.full((count, 4), -1.0), rest)
