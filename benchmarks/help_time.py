"""How long `flockscope --help` takes, beside an empty Python, and which of our dependencies it imports.

    PYTHONPATH=. python benchmarks/help_time.py [--rounds 15]

Wall and CPU seconds of new processes, best of the rounds (the CPU's is the steadier on a busy machine). Exit code 1
where it takes longer than must be.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MUST, AIM = 0.5, 0.25
HEAVY = ("numpy", "scipy", "numba", "pymunk", "cv2", "pyarrow", "pydantic", "filterpy", "gymnasium", "av")
LISTING = f"import sys, tracking.app.cli; print(*[m for m in {HEAVY!r} if m in sys.modules])"


def seconds(*words: str) -> tuple[float, float]:
    """Wall and CPU seconds of one process."""
    begin = time.perf_counter()
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(
        [sys.executable, *words], stdout=quiet, stderr=quiet, env={**os.environ, "PYTHONPATH": str(ROOT)}
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = status
    assert status == 0, words
    return time.perf_counter() - begin, used.ru_utime + used.ru_stime


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    args = parser.parse_args()
    cases = {
        "python -c pass": ("-c", "pass"),
        "flockscope --help": ("-m", "tracking.app.cli", "--help"),
        "import tracking": ("-c", "import tracking"),
    }
    print(f"load {os.getloadavg()[0]:.1f}\n| | wall s (best) | CPU s (best) |\n|---|---|---|")
    found = [{name: seconds(*words) for name, words in cases.items()} for _ in range(args.rounds)]
    best = {name: [min(column) for column in zip(*(f[name] for f in found), strict=True)] for name in cases}
    for name, (wall, cpu) in best.items():
        print(f"| {name} | {wall:.3f} | {cpu:.3f} |")
    imported = subprocess.run(
        [sys.executable, "-c", LISTING], capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    ).stdout  # fmt: skip
    print(f"imported by the command line: {imported.strip() or 'none of the heavy ones'}")
    print(f"must be {MUST} s, aim {AIM} s")
    return 0 if best["flockscope --help"][0] <= MUST else 1


if __name__ == "__main__":
    raise SystemExit(main())
