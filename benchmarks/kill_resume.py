"""`kill -9` in the middle of `flockscope generate`, then the same command again: is the dataset whole and the same?

    PYTHONPATH=. python benchmarks/kill_resume.py [--kills 20] [--entry merge queue] [--seeds 0:6] [--workers 1]
        [--streams left] [--images mp4]

Moments are random, one in each of `--kills` equal parts of the run: after so many whole sequences (the load of the
machine must not push all kills into the beginning) and a random part of the next one's time. `--writing` more fall into
the writing of a sequence: some milliseconds after a partial folder is seen, with pictures up to a sequence's time.
After a kill no sequence may stand there half-written; after resuming, `validate` must find nothing and every byte must
be that of the undisturbed run.
Exit code 1 where anything differs.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from datasets import Pictures, complete, content_hashes, file_bytes_hash, sequences, start, whole_run

from sim.io.store.validate import validate

Wait = Callable[[subprocess.Popen[str], Path], str]


def after(whole: int, later: float) -> Wait:
    """Wait for so many whole sequences, and `later` seconds more."""

    def wait(process: subprocess.Popen[str], out: Path) -> str:
        while process.poll() is None and len(complete(out)) < whole:
            time.sleep(0.002)
        time.sleep(later)
        return f"{whole} whole + {later:.2f} s"

    return wait


def writing(nth: int, later: float) -> Wait:
    """Wait for the nth partial folder, and `later` seconds more."""

    def wait(process: subprocess.Popen[str], out: Path) -> str:
        seen: set[str] = set()
        while process.poll() is None and len(seen) < nth:
            seen |= {p.name for p in out.glob("flockscope-*/.partial-*")}
        time.sleep(later)
        return f"partial folder {nth} + {1000 * later:.0f} ms"

    return wait


def kill(process: subprocess.Popen[str]) -> bool:
    """`kill -9` of the program (not its workers: they must see for themselves); whether it was still at work."""
    alive = process.poll() is None
    if alive:
        os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    return alive


def one(args: argparse.Namespace, wait: Wait, out: Path, right: str) -> bool:
    process = start(args.entry, args.seeds, out, args.workers, args.pictures)
    moment = wait(process, out)
    killed = kill(process)
    then, half = complete(out), [p for p in sequences(out) if validate(p)]
    partial = len(list(out.glob("flockscope-*/.partial-*")))
    whole_run(args.entry, args.seeds, out, args.workers, args.pictures)
    problems, same = validate(out), file_bytes_hash(out) == right
    print(
        f"| {moment} | {'yes' if killed else 'no'} | {len(then)} | {partial} | {len(half)} "
        f"| {len(problems)} | {'yes' if same else 'NO'} |",
        flush=True,
    )
    shutil.rmtree(out)
    return not half and not problems and same


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--writing", type=int, default=6)
    parser.add_argument("--entry", nargs="+", default=["merge", "queue"])
    parser.add_argument("--seeds", default="0:6")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--streams", default="none")
    parser.add_argument("--images", default="jpg")
    args = parser.parse_args()
    args.pictures = Pictures(args.streams, args.images)
    r = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        whole_run(args.entry, args.seeds, work / "warm", args.workers, args.pictures)
        seconds = whole_run(args.entry, args.seeds, work / "right", args.workers, args.pictures)
        right, n = file_bytes_hash(work / "right"), len(content_hashes(work / "right"))
        print(f"{n} sequences of {', '.join(args.entry)}, seeds {args.seeds}, {args.workers} workers: {seconds:.1f} s")
        print(args.pictures)
        print("| killed at | at work | whole then | partial | half-written | problems after | same bytes |")
        print("|---|---|---|---|---|---|---|")
        moments = (np.arange(args.kills) + r.random(args.kills)) / max(args.kills, 1) * n
        longest = 0.02 if args.streams == "none" else seconds / n
        waits = [after(int(m), float(m % 1) * seconds / n) for m in moments]
        waits += [writing(int(r.integers(1, n + 1)), float(r.uniform(0, longest))) for _ in range(args.writing)]
        good = sum(one(args, wait, work / "killed", right) for wait in waits) == len(waits)
    print("\nall the same" if good else "\nDIFFERENT")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
