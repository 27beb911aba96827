"""Two workers against one: wall time of `flockscope generate`, CPU time, and the largest memory of any process.

    PYTHONPATH=. python benchmarks/workers.py [--entry crowd] [--seeds 0:32] [--rounds 3]

Rounds time both in turn, and the best of each counts: the machine should have two idle cores (the load is printed). On
a busy one 2 CPU_1 / CPU_2 tells what two idle cores could give at most. What a process costs to begin is in it, so
--seeds must be many enough for it not to matter.
Memory must not grow with the number of sequences: a quarter of the seeds is made too. Exit code 1 below 1.7 times.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
import time
from pathlib import Path

from datasets import start

MUST, AIM = 1.7, 1.9
GROWTH = 1.1


def run(entries: list[str], seeds: str, workers: int) -> tuple[float, float, float]:
    """Wall seconds, CPU seconds of all processes, MB of the largest one."""
    with tempfile.TemporaryDirectory() as out:
        begin = time.perf_counter()
        process = start(entries, seeds, Path(out) / "out", workers, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        if status != 0:
            raise SystemExit(f"generate {' '.join(entries)}: exit status {status}")
        process.returncode = 0
        shutil.rmtree(Path(out) / "out")
    return wall, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--entry", nargs="+", default=["crowd"])
    parser.add_argument("--seeds", default="0:32")
    parser.add_argument("--rounds", type=int, default=3)
    args = parser.parse_args()
    low, high = map(int, args.seeds.split(":"))
    run(args.entry, f"{low}:{low + 1}", 1)  # compiles the kernels
    load = os.getloadavg()[0]
    found = [[run(args.entry, args.seeds, workers) for workers in (1, 2)] for _ in range(args.rounds)]
    few = run(args.entry, f"{low}:{low + max(1, (high - low) // 4)}", 1)
    print(f"{', '.join(args.entry)}, seeds {args.seeds}; load {load:.1f} before, {os.getloadavg()[0]:.1f} after")
    print("| workers | wall s (best) | CPU s (best) | MB of the largest process |\n|---|---|---|---|")
    best = [tuple(min(column) for column in zip(*(r[k] for r in found), strict=True)) for k in (0, 1)]
    for workers, (wall, cpu, memory) in zip((1, 2), best, strict=True):
        print(f"| {workers} | {wall:.1f} | {cpu:.1f} | {memory:.0f} |")
    print(f"| 1, a quarter of the seeds | {few[0]:.1f} | {few[1]:.1f} | {few[2]:.0f} |")
    speedup = best[0][0] / best[1][0]
    each = ", ".join(f"{one[0] / two[0]:.2f}" for one, two in found)
    possible = 2 * best[0][1] / best[1][1]
    print(f"speed-up {speedup:.2f} (rounds: {each}), by CPU time at most {possible:.2f}; must be {MUST}, aim {AIM}")
    print(f"memory with four times the sequences: x{best[0][2] / few[2]:.2f}; must be at most {GROWTH}")
    return 0 if speedup >= MUST and best[0][2] <= GROWTH * few[2] else 1


if __name__ == "__main__":
    raise SystemExit(main())
