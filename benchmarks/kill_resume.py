"""Is a dataset the same however it was made? Kills, resumes, repeats and varies the environment of `generate`.

    python benchmarks/kill_resume.py [--kills 20] [--entry merge] [--seeds 0:12] [--workers 2]

Part 1: `kill -9` at random moments of a run, then resume; after each the dataset must validate and be the same, byte
for byte. Part 2: the same in new processes, with 1 and 2 workers, and OMP_NUM_THREADS and PYTHONHASHSEED varied.
Exit code 1 where anything differs.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from sim.io.validate import validate

ROOT = Path(__file__).resolve().parents[1]


def command(args: argparse.Namespace, out: Path, workers: int) -> list[str]:
    """The command line of one run: of the program, or of the function it calls."""
    if (ROOT / "tracking" / "app" / "cli.py").is_file():
        words = ["-m", "tracking.app.cli", "generate", *args.entry, "--seeds", args.seeds]
        return [sys.executable, *words, "--out", str(out), "--workers", str(workers)]
    low, high = args.seeds.split(":")
    call = f"generate({args.entry}, range({low}, {high}), {str(out)!r}, workers={workers})"
    return [sys.executable, "-c", f"from sim.generate import generate\nif __name__ == '__main__':\n    {call}"]


def start(args: argparse.Namespace, out: Path, workers: int, **env: str) -> subprocess.Popen[bytes]:
    variables = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT), **env}
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command(args, out, workers), env=variables, cwd=ROOT, stdout=quiet, stderr=quiet)


def whole_run(args: argparse.Namespace, out: Path, workers: int, **env: str) -> float:
    begin = time.perf_counter()
    code = start(args, out, workers, **env).wait()
    if code != 0:
        raise SystemExit(f"{' '.join(command(args, out, workers))}: exit code {code}")
    return time.perf_counter() - begin


def dataset_hash(out: Path) -> str:
    """One hash over the names and bytes of all files."""
    h = hashlib.sha256()
    for path in sorted(p for p in out.rglob("*") if p.is_file()):
        h.update(f"{path.relative_to(out)}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return h.hexdigest()


def complete(out: Path) -> int:
    return len([p for p in out.glob("flockscope-*/*/manifest.json") if not p.parent.name.startswith(".")])


def half_written(out: Path) -> int:
    """Folders that look like sequences and are not whole."""
    folders = [p for p in out.glob("flockscope-*/*/") if not p.name.startswith(".")]
    return sum(bool(validate(p)) for p in folders)


def kills(args: argparse.Namespace, work: Path, right: str, seconds: float) -> bool:
    print(f"\n{args.kills} kills, {args.workers} workers (an undisturbed run takes {seconds:.1f} s)")
    print("| kill at s | whole then | half-written | after resuming: problems | same hash |\n|---|---|---|---|---|")
    moments, good = np.random.default_rng(0).uniform(0.3, 1.0, args.kills) * seconds, True
    for moment in sorted(moments):
        out = work / "killed"
        process = start(args, out, args.workers)
        try:
            process.wait(moment)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        then, half = complete(out), half_written(out)
        whole_run(args, out, args.workers)
        problems, same = len(validate(out)), dataset_hash(out) == right
        good &= not half and not problems and same
        print(f"| {moment:.2f} | {then} | {half} | {problems} | {'yes' if same else 'NO'} |", flush=True)
        shutil.rmtree(out)
    return good


def variations(args: argparse.Namespace, work: Path, right: str) -> bool:
    print("\n| workers | OMP_NUM_THREADS | PYTHONHASHSEED | s | same hash |\n|---|---|---|---|---|")
    good = True
    for workers, threads, seed in ((1, "1", "0"), (1, "1", "0"), (2, "1", "0"), (2, "2", "1"), (1, "2", "12345")):
        out = work / "varied"
        seconds = whole_run(args, out, workers, OMP_NUM_THREADS=threads, PYTHONHASHSEED=seed)
        same = dataset_hash(out) == right
        good &= same
        print(f"| {workers} | {threads} | {seed} | {seconds:.1f} | {'yes' if same else 'NO'} |", flush=True)
        shutil.rmtree(out)
    return good


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--entry", nargs="+", default=["merge"])
    parser.add_argument("--seeds", default="0:12")
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        whole_run(args, work / "warm", args.workers)
        seconds = whole_run(args, work / "right", args.workers)
        right = dataset_hash(work / "right")
        print(f"{complete(work / 'right')} sequences of {' '.join(args.entry)}, seeds {args.seeds}: {right[:16]}")
        good = variations(args, work, right) & kills(args, work, right, seconds)
    print("\nall the same" if good else "\nDIFFERENT")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
