"""The paper's Tables 2 and 3b: variants of the preset and of the default, on friends-meet and a recording of BIWI."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.joint.runs import PX_PER_M, Row, Variant, difference, mean_row, measured, pooled, sequences
from benchmarks.support import tables
from benchmarks.support.options import HOTEL, SHARED_DATA, seeds_text
from sim.io.source import open_source
from tracking.papers.joint.config import JointConfig

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
COLUMNS = ("error, px (std)", "1-FP, %", "1-FN, %", "GDSR, %", "MOTA, %", "MOTP, px")
PRINTED = "paper: error / 1-FP / 1-FN / GDSR / MOTA"
COMPARED = ("GDSR", "MOTA", "1-FN", "1-FP")
BIWI_FPS = 2.5  # Frames/s at which the recording is labelled.


def _variants(name: str, params: Mapping[str, object]) -> list[Variant]:
    found = [Variant(f"{name} {v}", params={**params, "variant": v}) for v in ("full", "VAR1", "VAR2", "VAR3")]
    known = {**params, "individuals": "measured", "particles": 1}
    return [*found, Variant(f"{name} .2", params=known, detections="truth")]


PRESET = _variants("preset", JointConfig.load("paper").as_dict())
DEFAULT = [Variant("default"), *_variants("default", {})]
PAIRS = (("full", "VAR1"), ("VAR1", "VAR2"), ("VAR2", "VAR3"), (".2", "full"))


def table2(given: argparse.Namespace) -> None:
    """Prints the tables of variants and the paired differences."""
    made = list(sequences(given.seeds))
    rows = {
        v.name: [mean_row(measured(s, v, given.filter_seeds, given.set)) for s in made] for v in (*PRESET, *DEFAULT)
    }
    title = f"{len(made)} sequences, seeds {seeds_text(given.seeds)}, filter seeds {seeds_text(given.filter_seeds)}"
    cells = {name: [*_cells(found), PAPER.get(name, "")] for name, found in rows.items()}
    tables.table(f"Table 2: {title}", "variant", [*COLUMNS, PRINTED], cells)
    differences = {}
    for system in ("preset", "default"):
        for first, second in PAIRS:
            a, b = f"{system} {first}", f"{system} {second}"
            differences[f"{a} − {second}"] = [difference(rows[a], rows[b], f"group_{k}") for k in COMPARED]
    tables.table("differences of means over sequences", "", COMPARED, differences)
    (recording,) = open_source(SHARED_DATA / HOTEL, images=False, fps=BIWI_FPS)
    chosen = [v for v in PRESET if v.name in PAPER_BIWI or v.name.endswith(".2")]
    seen = {v.name: replace(v, detections="truth") for v in chosen}
    found = {name: [mean_row(measured(recording, v, given.filter_seeds))] for name, v in seen.items()}
    cells = {name: [*_cells(one), PAPER_BIWI.get(name, "")] for name, one in found.items()}
    tables.table(f"Table 3b: {HOTEL}, its labelled points as detections", "variant", [*COLUMNS, PRINTED], cells)


def _cells(rows: list[Row]) -> list[str]:
    """Returns cells of COLUMNS; error: mean and deviation, over sequences, of the root mean square error."""
    error = PX_PER_M * np.array([row["RMSE_pos"] for row in rows])
    return [f"{np.nanmean(error):.2f} ({np.nanstd(error):.2f})", *pooled(rows, "")]
