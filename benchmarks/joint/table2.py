"""The paper's Table 2: variants on the suite friends-meet."""

from __future__ import annotations

import argparse

from benchmarks.joint.runs import (
    OTHERS,
    SHARES,
    Row,
    Variant,
    difference,
    mean_row,
    measured,
    others,
    pooled,
    sequences,
)
from benchmarks.support import tables
from benchmarks.support.options import seeds_text
from tracking.papers.joint.config import JointConfig

PAPER = {
    "full": ("93.7", "82.9", "79.7", "57.3"),
    "VAR1": ("93.8", "81.9", "78.3", "56.0"),
    "VAR2": ("82.1", "51.6", "48.1", "33.5"),
    "VAR3": ("65.1", "24.6", "18.9", "4.9"),
}
"""Table 2 of the paper, on its own 28 sequences, %: 1-FP, 1-FN, GDSR, MOTA."""
COMPARED = ("GDSR", "MOTA", "1-FN", "1-FP")
VARIANTS = (
    Variant("full"),
    Variant("VAR1", params={"variant": "VAR1"}),
    Variant("VAR2", params={"variant": "VAR2"}),
    Variant("VAR3", params={"variant": "VAR3"}),
    Variant(".2", params={"individuals": "measured"}, detections="truth"),
    Variant("preset paper", params=JointConfig.preset("paper").as_dict()),
    Variant("relational", "relational"),
    Variant("group-pda", "group-pda", seeds=False),
    Variant("blob + default grouping", "blob", seeds=False),
)


def table2(given: argparse.Namespace) -> None:
    """Prints the table of variants and the paired differences."""
    chosen = [v for v in VARIANTS if not given.only or v.name in given.only.split(",")]
    rows: dict[str, list[Row]] = {v.name: [] for v in chosen}
    kinds = []
    for sequence in sequences(given.seeds):
        kinds.append(sequence.name.rstrip("-0123456789"))
        for v in chosen:
            rows[v.name].append(mean_row(measured(sequence, v, given.filter_seeds, given.set)))
    title = f"{len(rows[chosen[0].name])} sequences, seeds {seeds_text(given.seeds)}, "
    title += f"filter seeds {seeds_text(given.filter_seeds)}"
    for part, end in (("strict", ""), ("core", "_core")):
        cells = {name: [*pooled(found, end), " / ".join(PAPER.get(name, ()))] for name, found in rows.items()}
        columns = [*(f"{name}, %" for name in SHARES), "MOTP, px", "paper: 1-FP / 1-FN / GDSR / MOTA"]
        tables.table(f"{part}: {title}", "variant", columns, cells)
    tables.table(f"other scores: {title}", "variant", OTHERS, {name: others(found) for name, found in rows.items()})
    cells = {}
    for first, second in (("full", "VAR1"), ("VAR1", "VAR2"), ("full", "VAR2"), ("VAR2", "VAR3"), (".2", "full")):
        if first in rows and second in rows:
            cells[f"{first} − {second}"] = [difference(rows[first], rows[second], f"group_{k}") for k in COMPARED]
    if cells:
        tables.table("differences of means over sequences, strict", "", COMPARED, cells)
    first = chosen[0].name
    cells = {
        kind: pooled([row for row, name in zip(rows[first], kinds, strict=True) if name == kind], "_core")[:4]
        for kind in dict.fromkeys(kinds)
    }
    tables.table(f"core, {first}, by sequence: {title}", "sequences", [f"{name}, %" for name in SHARES], cells)
