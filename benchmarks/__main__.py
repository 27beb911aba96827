"""Runs a benchmark: `python -m benchmarks NAME …`. The benchmark `results` makes what the documentation shows."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

NAMES = sorted(p.stem for p in Path(__file__).parent.iterdir() if not p.name.startswith("__") and p.name != "support")

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in NAMES:
        raise SystemExit(f"{__doc__}\n\nBenchmarks: {', '.join(NAMES)}")
    name = sys.argv.pop(1)
    runpy.run_module(f"benchmarks.{name}", run_name="__main__", alter_sys=True)
