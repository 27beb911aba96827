"""Runs a benchmark: `python -m benchmarks NAME …`. The benchmark `results` makes what the documentation shows.

Input that is wrong or missing ends it with one line and exit code 2.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

from benchmarks.support.options import one_thread
from scenarios.errors import FlockscopeError

NAMES = sorted(p.stem for p in Path(__file__).parent.iterdir() if not p.name.startswith("__") and p.name != "support")

if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in NAMES:
        raise SystemExit(f"{__doc__}\n\nBenchmarks: {', '.join(NAMES)}")
    one_thread()
    name = sys.argv.pop(1)
    try:
        runpy.run_module(f"benchmarks.{name}", run_name="__main__", alter_sys=True)
    except FlockscopeError as error:
        print(error.line(), file=sys.stderr)
        sys.exit(2)
