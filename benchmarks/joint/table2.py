"""The paper's Tables 2 and 3b: variants of the preset and of the default, on friends-meet and a recording of BIWI.

The paper heads its errors "MSE px (std)" and does not say over what the standard deviation is. Here it is of the mean
square errors of the sequences, px^2.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.joint.runs import Row, Variant, difference, mean_row, measured, pooled, sequences
from benchmarks.support import tables
from benchmarks.support.options import HOTEL, seeds_text
from sim.types import Sequence as Recording
from tracking.papers.joint.config import JointConfig
from tracking.recordings.source import open_source

# Table 2 of the paper, on its own 28 sequences.
PAPER = {
    "preset full": "2.18 (4.96) / 93.7 / 82.9 / 79.7 / 57.3",
    "preset VAR1": "2.19 (5.46) / 93.8 / 81.9 / 78.3 / 56.0",
    "preset VAR2": "3.72 (11.81) / 82.1 / 51.6 / 48.1 / 33.5",
    "preset VAR3": "2.52 (8.35) / 65.1 / 24.6 / 18.9 / 4.9",
}
# Table 3b of the paper, on sequences of BIWI that it does not name.
PAPER_BIWI = {
    "preset full": "– / 53.8 / 78.0 / 53.6 / 29.4",
    "preset VAR3": "– / 60.6 / 51.6 / 29.6 / 9.6",
}
COLUMNS = ("MSE, px² (std)", "1-FP, %", "1-FN, %", "GDSR, %", "MOTA, %", "MOTP, px")
PRINTED = "paper: MSE, px (std) / 1-FP / 1-FN / GDSR / MOTA"
COMPARED = {"GDSR": "group_GDSR", "MOTA": "group_MOTA", "1-FN": "group_1-FN", "1-FP": "group_1-FP"}
NUMBERS = (50, 200, 800)  # N_x of the mode particles.
BIWI_FPS = 2.5  # Frames/s at which the recording is labelled.


def _variants(name: str, params: Mapping[str, object]) -> list[Variant]:
    found = [Variant(f"{name} {v}", params={**params, "variant": v}) for v in ("full", "VAR1", "VAR2", "VAR3")]
    known = {**params, "individuals": "measured", "particles": 1}
    return [*found, Variant(f"{name} .2", params=known, detections="truth")]


PRESET = _variants("preset", JointConfig.load("paper").as_dict())
DEFAULT = [Variant("default"), *_variants("default", {})]
PAIRS = (("full", "VAR1"), ("VAR1", "VAR2"), ("VAR2", "VAR3"), (".2", "full"))


def table2(given: argparse.Namespace) -> None:
    """Prints the tables of variants and the paired differences; exit code 1 if the recording of Table 3b is missing."""
    if missing := not (given.data / HOTEL).is_dir():
        print(f"Table 3b is left out: {HOTEL} is not in {given.data}; give its folder by --data", file=sys.stderr)
    made = list(sequences(given.seeds))
    rows = _scored(made, (*PRESET, *DEFAULT), given)
    cells = {name: [*_cells(found), PAPER.get(name, "")] for name, found in rows.items()}
    tables.table(f"Table 2: {_heading(made, given)}", "variant", [*COLUMNS, PRINTED], cells)
    pairs = {f"{s} {a} − {b}": (rows[f"{s} {a}"], rows[f"{s} {b}"]) for s in ("preset", "default") for a, b in PAIRS}
    _differences(pairs, COMPARED)
    if missing:
        raise SystemExit(1)
    recording = list(open_source(given.data / HOTEL, images=False, fps=BIWI_FPS))
    seen = [replace(v, detections="truth") for v in PRESET if v.name in PAPER_BIWI or v.name.endswith(".2")]
    cells = {name: [*_cells(one), PAPER_BIWI.get(name, "")] for name, one in _scored(recording, seen, given).items()}
    tables.table(f"Table 3b: {HOTEL}, its labelled points as detections", "variant", [*COLUMNS, PRINTED], cells)


def by_number(given: argparse.Namespace) -> None:
    """Prints the scores of full and VAR1 of the preset by the number of particles of individuals, and differences."""
    made, first = list(sequences(given.seeds)), NUMBERS[0]
    variants = [Variant(f"{v.name}, N_x {n}", {**v.params, "particles": n}) for n in NUMBERS for v in PRESET[:2]]
    rows = _scored(made, variants, given)
    tables.table(f"Preset: {_heading(made, given)}", "variant", COLUMNS, {k: _cells(one) for k, one in rows.items()})
    pairs = {f"full − VAR1, N_x {n}": (rows[f"preset full, N_x {n}"], rows[f"preset VAR1, N_x {n}"]) for n in NUMBERS}
    pairs |= {f"{v.name}, N_x {n} − {first}": (rows[f"{v.name}, N_x {n}"], rows[f"{v.name}, N_x {first}"])
              for v in PRESET[:2] for n in NUMBERS[1:]}  # fmt: skip
    _differences(pairs, {"MSE, px²": "MSE", **COMPARED})


def _scored(made: Sequence[Recording], variants: Sequence[Variant], given: argparse.Namespace) -> dict[str, list[Row]]:
    """Returns the scores of each variant by sequence, means over the filter seeds."""
    return {v.name: [mean_row(measured(s, v, given.filter_seeds, given.set)) for s in made] for v in variants}


def _heading(made: Sequence[Recording], given: argparse.Namespace) -> str:
    return f"{len(made)} sequences, seeds {seeds_text(given.seeds)}, filter seeds {seeds_text(given.filter_seeds)}"


def _differences(pairs: Mapping[str, tuple[list[Row], list[Row]]], keys: Mapping[str, str]) -> None:
    cells = {name: [difference(a, b, key) for key in keys.values()] for name, (a, b) in pairs.items()}
    tables.table("differences of means over sequences", "", list(keys), cells)


def _cells(rows: list[Row]) -> list[str]:
    """Returns cells of COLUMNS; MSE: mean and standard deviation over the sequences."""
    error = [row["MSE"] for row in rows]
    return [f"{np.nanmean(error):.1f} ({np.nanstd(error):.1f})", *pooled(rows, "")]
