"""Reads damaged inputs of every kind until the time is over, and prints each bug once, with the seed that repeats it.

    python -m benchmarks.fuzz --minutes 60                  every kind of input, in turn
    python -m benchmarks.fuzz --kinds caviar,video          some kinds
    python -m benchmarks.fuzz --kinds caviar --seed 117     one case again, with its file kept

The cases run in a child process, which is started again after a crash. Exit code 1 if a bug was found.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from random import Random
from zlib import crc32

from benchmarks.fuzz.cases import case, damage, outcome
from benchmarks.fuzz.readers import READERS
from benchmarks.fuzz.specimens import write_specimens
from benchmarks.support.options import new_parser, one_thread


def random_of(kind: str, seed: int) -> Random:
    """Returns the source of all choices of a case."""
    return Random(crc32(kind.encode()) * 2**32 + seed)


def worker(root: Path, kinds: list[str], first: int) -> None:
    """Runs case after case, for each seed from `first` all kinds; prints a JSON line before and after each."""
    for seed in range(first, sys.maxsize):
        for kind in kinds:
            print(json.dumps({"kind": kind, "seed": seed}), flush=True)
            folder = root / "cases" / f"{kind.replace(' ', '-')}-{seed}"
            specimen = root / ("dataset" if kind == "truth" else kind.replace(" ", "-"))
            name, found = case(kind, specimen, folder, random_of(kind, seed))
            answer = {"kind": kind, "seed": seed, "file": name, "is": found.kind, "text": found.text}
            print(json.dumps(answer), flush=True)


def again(root: Path, kind: str, seed: int) -> int:
    """Repeats one case, keeps its files, and prints the outcome; returns the exit code."""
    folder = Path(tempfile.mkdtemp(prefix="flockscope-case-")) / kind.replace(" ", "-")
    specimen = root / ("dataset" if kind == "truth" else kind.replace(" ", "-"))
    name = damage(kind, specimen, folder, random_of(kind, seed))
    found = outcome(kind, folder)
    print(f"{folder / name}: {found.kind} {found.text}")
    return int(found.kind == "bug")


def run(root: Path, kinds: list[str], first: int, minutes: float) -> tuple[Counter[tuple[str, str]], dict[str, str]]:
    """Runs cases for some minutes; returns counts by (kind, outcome) and the first case of each bug by its text."""
    counts: Counter[tuple[str, str]] = Counter()
    bugs: dict[str, str] = {}
    end, seed = time.monotonic() + 60 * minutes, first
    while time.monotonic() < end:
        words = [sys.executable, "-m", "benchmarks.fuzz", "--root", str(root), "--kinds", ",".join(kinds)]
        child = subprocess.Popen(
            [*words, "--worker", str(seed)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert child.stdout is not None
        last: dict[str, str | int] = {}
        for line in child.stdout:
            last = json.loads(line)
            seed = int(last["seed"])
            if "is" in last:
                counts[str(last["kind"]), str(last["is"])] += 1
                _note(bugs, last)
            if time.monotonic() > end:
                child.kill()
                break
        if child.wait() and time.monotonic() < end:
            _note(bugs, {**last, "is": "bug", "file": "?", "text": f"the process ended with {child.returncode}"})
            seed += 1
    return counts, bugs


def _note(bugs: dict[str, str], answer: dict[str, str | int]) -> None:
    key = f"{answer['kind']}: {answer['text']}"[:120]
    if answer["is"] == "bug" and key not in bugs:
        bugs[key] = f"--kinds '{answer['kind']}' --seed {answer['seed']} ({answer['file']}): {answer['text']}"
        print(bugs[key], file=sys.stderr, flush=True)


def main() -> int:
    """Runs the command and returns its exit code."""
    parser = new_parser(__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="time for all kinds together")
    parser.add_argument("--kinds", default=",".join(READERS), help="kinds of input, separated by commas")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--seed", type=int, help="repeat this case of one kind")
    parser.add_argument("--root", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--worker", type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    kinds = given.kinds.split(",")
    if given.worker is not None:
        worker(given.root, kinds, given.worker)
    root = Path(tempfile.mkdtemp(prefix="flockscope-fuzz-"))
    try:
        write_specimens(root)
        if given.seed is not None:
            return again(root, kinds[0], given.seed)
        counts, bugs = run(root, kinds, given.first, given.minutes)
    finally:
        shutil.rmtree(root, ignore_errors=True)
    print("| input | cases | read | refused | bugs |\n|---|---|---|---|---|")
    for kind in kinds:
        ok, refused, bug = (counts[kind, name] for name in ("ok", "refused", "bug"))
        print(f"| {kind} | {ok + refused + bug} | {ok} | {refused} | {bug} |")
    print(f"\n{sum(counts.values())} cases, {len(bugs)} different bugs")
    print("".join(f"\n{text}" for text in bugs.values()))
    return int(bool(bugs))


if __name__ == "__main__":
    one_thread()
    sys.exit(main())
