"""Is a dataset the same, byte for byte, however it is made: ways of running, kill -9, a killed cluster worker?

    python -m benchmarks.reproducibility ways [--entry merge split …] [--seeds 0:2] [--streams left] [--images jpg mp4]
    python -m benchmarks.reproducibility kill [--entry merge queue] [--seeds 0:6] [--kills 20] [--writing 6]
        [--workers 1] [--streams left] [--images mp4]
    python -m benchmarks.reproducibility worker [--entry side-by-side] [--seeds 0:1000] [--set duration=4]

ways: the same dataset by one and two workers, again, with other threads, hash seeds, zones and freshly compiled
kernels, and in this process in reverse order. With several --images their content hashes must be equal, too, and every
truth hash must equal that of a run without pictures. Columns: number of sequences, sequences whose content hash differs
from the first way's, whether all file bytes are equal.
kill: `kill -9` during `flockscope generate`, then the same command again. --kills random moments lie one in each equal
part of the run; --writing more fall into the writing of a sequence. Columns: moment; whether the command was still
running; complete sequences, partial folders and invalid sequences at that moment; problems that `validate` finds after
the second run; whether all bytes are those of an undisturbed run.
worker: a dask scheduler and two workers on loopback; the first worker gets `kill -9` when half of the sequences are
complete, and is not started again. Printed: wall seconds and hashes of one process and of the cluster.
Exit code 1 if anything differs.
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
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.support.generate_runs import (
    GenerateRun,
    complete,
    file_bytes_hash,
    finished,
    manifest_values,
    partial,
    sequences,
)
from benchmarks.support.options import new_parser, seed_range
from benchmarks.support.tables import head, row
from sim.dataset.generate import generate
from sim.store.validate import validate
from tests.loopback import loopback

ENTRIES = {
    "ways": ["merge", "split", "cross", "queue", "pillar", "door", "stairs", "party", "clutter", "side-by-side"],
    "kill": ["merge", "queue"],
    "worker": ["side-by-side"],
}
SEEDS = {"ways": "0:2", "kill": "0:6", "worker": "0:1000"}
Wait = Callable[[subprocess.Popen[str], Path], str]


def threads(count: int = 1, hash_seed: int = 0, **more: str) -> dict[str, str]:
    """Returns the environment variables of a run."""
    some = {"OMP_NUM_THREADS": str(count), "OPENBLAS_NUM_THREADS": str(count), "PYTHONHASHSEED": str(hash_seed)}
    return {**some, **more}


WAYS = {
    "1 worker": (1, threads()),
    "again": (1, threads()),
    "2 workers": (2, threads()),
    "OMP_NUM_THREADS=2": (1, threads(count=2)),
    "PYTHONHASHSEED=12345": (1, threads(hash_seed=12345)),
    "2 workers, 4 threads, hash seed 7": (2, threads(count=4, hash_seed=7)),
    "kernels compiled anew, another zone, C locale": (1, threads(TZ="Asia/Tokyo", LC_ALL="C", NUMBA_CACHE_DIR="")),
}
HERE = "in this process, reverse order"


def dataset_hashes(way: str, run: GenerateRun, work: Path) -> tuple[dict[str, str], str]:
    """Makes the dataset in one way; returns content hashes by sequence, and the hash of all bytes."""
    out = work / "out"
    if way == HERE:
        streams = () if run.streams == "none" else tuple(run.streams.split(","))
        for entry in reversed(run.entries):
            settings = run.more[1::2]
            generate([entry], seed_range(run.seeds), out, set=settings, streams=streams, images=run.images)
    else:
        workers, env = WAYS[way]
        if "NUMBA_CACHE_DIR" in env:
            env = {**env, "NUMBA_CACHE_DIR": str(work / "cache")}
        replace(run, workers=workers, env=env).finish(out)
    found = manifest_values(out, "content_hash"), file_bytes_hash(out)
    shutil.rmtree(out)
    return found


def compare_ways(run: GenerateRun, work: Path) -> tuple[bool, dict[str, str]]:
    """Prints the table of one kind of images; returns whether all ways are equal, and the content hashes."""
    equal, first = True, None
    print(f"streams {run.streams}, images {run.images}")
    head(["way", "sequences", "content hashes that differ", "all bytes"])
    for way in (*WAYS, HERE):
        hashes, everything = dataset_hashes(way, run, work)
        first = first or (hashes, everything)
        other = sorted(k for k in hashes.keys() | first[0].keys() if hashes.get(k) != first[0].get(k))
        equal &= everything == first[1] and not other
        row([way, str(len(hashes)), " ".join(other) or "none", "same" if everything == first[1] else "DIFFER"])
    assert first is not None
    return equal, first[0]


def truth_hashes(run: GenerateRun, work: Path) -> dict[str, str]:
    """Makes the dataset and returns the truth hash of each sequence."""
    run.finish(work / "out")
    found = manifest_values(work / "out", "truth_hash")
    shutil.rmtree(work / "out")
    return found


def ways(args: argparse.Namespace, run: GenerateRun, work: Path) -> bool:
    found = [compare_ways(replace(run, images=images), work) for images in args.images]
    equal = all(same and hashes == found[0][1] for same, hashes in found)
    print(f"content hashes of {', '.join(args.images)}: {'equal' if equal else 'see above, or DIFFERENT'}")
    if run.streams != "none":
        same = truth_hashes(run, work) == truth_hashes(run.without_pictures(), work)
        print(f"truth hashes with and without pictures: {'equal' if same else 'DIFFERENT'}")
        equal &= same
    return equal


def after_sequences(count: int, later: float) -> Wait:
    """Returns a function that waits for `count` complete sequences, and `later` seconds more."""

    def wait(process: subprocess.Popen[str], out: Path) -> str:
        while process.poll() is None and len(complete(out)) < count:
            time.sleep(0.002)
        time.sleep(later)
        return f"{count} complete + {later:.2f} s"

    return wait


def while_writing(nth: int, later: float) -> Wait:
    """Returns a function that waits for the nth partial folder, and `later` seconds more."""

    def wait(process: subprocess.Popen[str], out: Path) -> str:
        seen: set[Path] = set()
        while process.poll() is None and len(seen) < nth:
            seen |= set(partial(out))
        time.sleep(later)
        return f"partial folder {nth} + {1000 * later:.0f} ms"

    return wait


def kill_and_resume(run: GenerateRun, wait: Wait, out: Path, expected: str) -> bool:
    """Kills one run, resumes it and prints a row; returns whether nothing was invalid and all bytes are as expected.

    Only the main process is killed: its workers must notice by themselves.
    """
    process = run.start(out)
    moment = wait(process, out)
    running = process.poll() is None
    if running:
        os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    then, unfinished, invalid = complete(out), partial(out), [p for p in sequences(out) if validate(p)]
    run.finish(out)
    problems, same = validate(out), file_bytes_hash(out) == expected
    counts = (len(then), len(unfinished), len(invalid), len(problems))
    row([moment, "yes" if running else "no", *map(str, counts), "yes" if same else "NO"])
    shutil.rmtree(out)
    return not invalid and not problems and same


def kill(args: argparse.Namespace, run: GenerateRun, work: Path) -> bool:
    run, r = replace(run, images=args.images[0]), np.random.default_rng(0)
    run.finish(work / "warm")
    seconds = run.finish(work / "expected")
    expected, n = file_bytes_hash(work / "expected"), len(complete(work / "expected"))
    print(f"{n} sequences, {run}: {seconds:.1f} s")
    head(["killed at", "running", "complete", "partial", "invalid", "problems after", "same bytes"])
    moments = (np.arange(args.kills) + r.random(args.kills)) / max(args.kills, 1) * n
    longest = 0.02 if run.streams == "none" else seconds / n
    waits = [after_sequences(int(m), float(m % 1) * seconds / n) for m in moments]
    waits += [while_writing(int(r.integers(1, n + 1)), float(r.uniform(0, longest))) for _ in range(args.writing)]
    return sum(kill_and_resume(run, wait, work / "killed", expected) for wait in waits) == len(waits)


def killed_worker_run(run: GenerateRun, half: int, out: Path, logs: Path) -> tuple[float, int, int]:
    """Returns wall seconds, and complete sequences and partial folders when the worker was killed."""
    with loopback(logs, 2) as cluster:
        begun = time.perf_counter()
        process = replace(run, more=(*run.more, "--cluster", cluster.address)).start(out)
        while process.poll() is None and len(complete(out)) < half:
            time.sleep(0.05)
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        cluster.workers[0].wait()
        then, unfinished = len(complete(out)), len(partial(out))
        finished(process)
        return time.perf_counter() - begun, then, unfinished


def worker(args: argparse.Namespace, run: GenerateRun, work: Path) -> bool:
    replace(run, seeds="0:1").finish(work / "warm")
    alone, expected = run.finish(work / "one"), file_bytes_hash(work / "one")
    count = len(complete(work / "one"))
    seconds, then, unfinished = killed_worker_run(run, count // 2, work / "cluster", work)
    problems, found = validate(work / "cluster"), file_bytes_hash(work / "cluster")
    print(f"one process: {alone:.0f} s; {count} sequences, all files {expected[:16]}")
    print(f"two workers, one killed with {then} complete ({unfinished} partial): {seconds:.0f} s")
    print(f"{len(complete(work / 'cluster'))} sequences, all files {found[:16]}; problems: {len(problems)}")
    return found == expected and not problems


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["ways", "kill", "worker"])
    parser.add_argument("--entry", nargs="+")
    parser.add_argument("--seeds", metavar="A:B")
    parser.add_argument("--set", nargs="*", metavar="KEY=VALUE", help="settings of the scenarios; worker: duration=4")
    parser.add_argument("--streams", default="none")
    parser.add_argument("--images", nargs="+", default=["jpg"])
    parser.add_argument("--workers", type=int, default=1, help="kill: processes of `generate`")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--writing", type=int, default=6)
    args = parser.parse_args()
    settings = args.set if args.set is not None else ["duration=4"] if args.mode == "worker" else []
    more = [word for text in settings for word in ("--set", text)]
    entries, seeds = args.entry or ENTRIES[args.mode], args.seeds or SEEDS[args.mode]
    run = GenerateRun(entries, seeds, args.workers, args.streams, args.images[0], more)
    with tempfile.TemporaryDirectory() as name:
        equal = {"ways": ways, "kill": kill, "worker": worker}[args.mode](args, run, Path(name))
    print("\nall the same" if equal else "\nDIFFERENT")
    return 0 if equal else 1


if __name__ == "__main__":
    raise SystemExit(main())
