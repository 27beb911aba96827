"""`group-pda`: what it does right, where it breaks, which of its decisions earn their keep, what it costs.

    PYTHONPATH=. python benchmarks/group_pda.py MODE [--seeds a:b] [--detections file|truth|image] [--json FILE] …

scenarios    merging, splitting, crossing, queueing, side by side: lineage, ids, group scores; beside the paper's
             ablation and the baseline rule over `blob`
difference   passing and crossing groups that keep their ids, against the difference of their velocities (a chart)
decisions    each decision of the tracker switched off, differences in pairs
events       merges and splits of the suites standard and friends-meet
real         seq_hotel, Meet_WalkTogether1, PETS09-S2L1 (--data FOLDER or $FLOCKSCOPE_DATA; docs/formats.md)
cost         time of a step against the number of measurements
consistency  NEES, NIS and whiteness of the centroid's filter

Detections "file" and "truth" are points, "image" the tracker's own foreground pixels; groups from pixels are scored in
the image, all others on the ground. Intervals are of 95 %: of means by bootstrap over sequences, of shares by Wilson.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks import (
    group_pda_consistency,
    group_pda_cost,
    group_pda_difference,
    group_pda_real,
    group_pda_scenes,
)
from sim.workers.protocol import THREAD_VARIABLES

MODES: dict[str, Callable[[argparse.Namespace], Any]] = {
    "scenarios": group_pda_scenes.scenarios,
    "difference": group_pda_difference.difference,
    "decisions": group_pda_scenes.decisions,
    "events": group_pda_scenes.events,
    "real": group_pda_real.real,
    "cost": group_pda_cost.cost,
    "consistency": group_pda_consistency.consistency,
}


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("mode", choices=MODES)
    made.add_argument("--seeds", default="20000:20100", help="half-open range a:b")
    made.add_argument("--image-seeds", default="20000:20025", help="difference: seeds of the curves from pixels")
    made.add_argument("--detections", choices=("file", "truth", "image"), default="file")
    made.add_argument("--only", help="scenes, suites, parts or differences, separated by commas")
    made.add_argument("--each", action="store_true", help="decisions: scene by scene, too")
    made.add_argument("--alone", action="store_true", help="scenarios, events: without those it is compared with")
    made.add_argument("--workers", type=int, default=2)
    made.add_argument("--tracker", default="group-pda", help="another tracker with the same parameters")
    made.add_argument("--data", type=Path, default=os.environ.get("FLOCKSCOPE_DATA", beside()))
    made.add_argument("--out", type=Path, help="difference: the chart, *.svg; real: the video, *.mp4")
    made.add_argument("--runs", type=int, default=400, help="consistency: independent runs")
    made.add_argument("--json", type=Path, help="writes what was measured, sequence by sequence")
    return made


def beside() -> Path:
    """Where real recordings lie if nothing is said."""
    return Path(__file__).resolve().parents[2] / "shared" / "data"


def main() -> None:
    given = parser().parse_args()
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    found = MODES[given.mode](given)
    if given.json is not None:
        given.json.write_text(json.dumps({"mode": given.mode, "seeds": given.seeds, "found": found}), encoding="utf-8")


if __name__ == "__main__":
    main()
