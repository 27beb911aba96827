"""How long `flockscope --help` takes beside an empty Python, and which heavy libraries the command line imports.

    python -m benchmarks.start_up [--rounds 15]

Columns: wall and CPU seconds of a new process, each the best of the rounds. CPU seconds are steadier on a busy machine.
Exit code 1 if the best wall time of `flockscope --help` exceeds MUST seconds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

from benchmarks.support.generate_runs import ROOT
from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row
from benchmarks.support.timing import machine_load

MUST, AIM = 0.5, 0.25  # s
HEAVY = ("numpy", "scipy", "numba", "pymunk", "cv2", "pyarrow", "pydantic", "filterpy", "gymnasium", "av")
LISTING = f"import sys, tracking.app.cli; print(*[m for m in {HEAVY!r} if m in sys.modules])"
CASES = {
    "python -c pass": ("-c", "pass"),
    "flockscope --help": ("-m", "tracking.app.cli", "--help"),
    "import tracking": ("-c", "import tracking"),
}
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def process_seconds(*words: str) -> tuple[float, float]:
    """Returns wall and CPU seconds of one Python process."""
    begun, quiet = time.perf_counter(), subprocess.DEVNULL
    process = subprocess.Popen([sys.executable, *words], stdout=quiet, stderr=quiet, env=ENVIRONMENT)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = status
    assert status == 0, words
    return time.perf_counter() - begun, used.ru_utime + used.ru_stime


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    found = [{name: process_seconds(*words) for name, words in CASES.items()} for _ in range(rounds)]
    best = {name: [min(column) for column in zip(*(f[name] for f in found), strict=True)] for name in CASES}
    print(machine_load())
    head(["", "wall s (best)", "CPU s (best)"])
    for name, (wall, cpu) in best.items():
        row([name, f"{wall:.3f}", f"{cpu:.3f}"])
    listing = [sys.executable, "-c", LISTING]
    imported = subprocess.run(listing, capture_output=True, text=True, check=True, env=ENVIRONMENT).stdout
    print(f"heavy libraries imported by the command line: {imported.strip() or 'none'}")
    print(f"must be {MUST} s, aim {AIM} s")
    return 0 if best["flockscope --help"][0] <= MUST else 1


if __name__ == "__main__":
    raise SystemExit(main())
