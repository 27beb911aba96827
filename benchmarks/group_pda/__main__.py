"""`group-pda`: scores by scene, and its decisions one by one.

    python -m benchmarks.group_pda MODE [--seeds a:b] [--detections file|truth|image] [--only A,B] [--json FILE] …

scenarios    merging, splitting, crossing, queueing, side by side: lineage, ids, group scores; beside the preset and
             the rule and the belief over `blob`
ablation     the paper's ablation (sec. 5.2.1) of its preset, from pixels and from points: paired differences
decisions    each decision of the tracker switched off: paired differences

The docstring of scenes.py says what the columns mean. Detections "file" and "truth" are points, "image" the tracker's
own foreground pixels. Groups from pixels are scored in the image,
all others on the ground. Intervals are 95 % intervals: of means by Student's t over sequences, of shares by Wilson.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.group_pda import scenes
from benchmarks.support.options import add_seeds, new_parser, one_thread, seeds_text

MODES: dict[str, Callable[[argparse.Namespace], Any]] = {
    "scenarios": scenes.scenarios,
    "ablation": scenes.ablation,
    "decisions": scenes.decisions,
}


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=MODES)
    add_seeds(parser, "20000:20100")
    parser.add_argument("--detections", choices=("file", "truth", "image"), default="file")
    parser.add_argument("--points", choices=("own", "seen", "foot"), help="sensor.points of scenes and suites")
    parser.add_argument("--set", nargs="+", default=[], metavar="KEY=VALUE", help="keys of scenes and suites")
    parser.add_argument("--only", help="scenes, separated by commas")
    parser.add_argument("--each", action="store_true", help="decisions: scene by scene, too")
    parser.add_argument("--alone", action="store_true", help="scenarios: without the preset and the baseline")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--tracker", default="group-pda", help="another tracker with the same parameters")
    parser.add_argument("--json", type=Path, help="writes what was measured, sequence by sequence")
    args = parser.parse_args()
    one_thread()
    found = MODES[args.mode](args)
    if args.json is not None:
        content = {"mode": args.mode, "seeds": seeds_text(args.seeds), "found": found}
        args.json.write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    main()
