"""A dask cluster of two workers, separate processes on loopback: one is killed half-way; is the dataset the same?

    PYTHONPATH=. python benchmarks/cluster.py [--sequences 1000] [--entry side-by-side] [--set duration=4] [--rounds 0]

The dataset is made by one process, and by the cluster, whose first worker gets `kill -9` when half of the sequences are
there, and is not started again. `validate` must find nothing in the second, and every byte must be that of the first.
`--rounds` then times fewer sequences in turn by this process alone, two processes, and a cluster of one and of two
workers; what processes cost to begin is in the times, --timed must be many enough for it not to matter. On a busy
machine 2 CPU_1 / CPU_2 (CPU seconds of all processes that work) says what two idle cores could give at most.
Exit code 1 where anything differs.
"""

from __future__ import annotations

import argparse
import os
import signal
import tempfile
import time
from pathlib import Path

import psutil
from datasets import NONE, complete, file_bytes_hash, start, whole_run

from sim.io.store.validate import validate
from tests.loopback import Loopback, loopback


def killed_run(args: argparse.Namespace, out: Path, logs: Path) -> tuple[float, int, int]:
    """Wall seconds; sequences that stood there when a worker was killed, and that it left half-written."""
    with loopback(logs, 2) as cluster:
        begin = time.perf_counter()
        process = start(args.entry, f"0:{args.sequences}", out, 1, NONE, (*args.more, "--cluster", cluster.address))
        while process.poll() is None and len(complete(out)) < args.sequences // 2:
            time.sleep(0.05)
        os.kill(cluster.workers[0].pid, signal.SIGKILL)
        cluster.workers[0].wait()
        then, partial = len(complete(out)), len(list(out.glob("flockscope-*/.partial-*")))
        answer = process.communicate()[0]
        if process.returncode != 0:
            raise SystemExit(f"exit code {process.returncode}: {answer[:600]}")
        return time.perf_counter() - begin, then, partial


def prove(args: argparse.Namespace, work: Path) -> bool:
    whole_run(args.entry, "0:1", work / "warm", 1, NONE, args.more)
    alone = whole_run(args.entry, f"0:{args.sequences}", work / "one", 1, NONE, args.more)
    right = file_bytes_hash(work / "one")
    seconds, then, partial = killed_run(args, work / "cluster", work)
    problems, found = validate(work / "cluster"), file_bytes_hash(work / "cluster")
    print(f"one process: {alone:.0f} s; {len(complete(work / 'one'))} sequences, all files {right[:16]}")
    print(f"two workers, one killed with {then} sequences there ({partial} half-written): {seconds:.0f} s")
    print(f"{len(complete(work / 'cluster'))} sequences, all files {found[:16]}; problems: {len(problems)}")
    return found == right and not problems


def timed(args: argparse.Namespace, workers: int, cluster: Loopback | None) -> tuple[float, float]:
    """Wall and CPU seconds of a run by processes of its own, or the workers of a cluster."""
    with tempfile.TemporaryDirectory() as name:
        before = used(cluster)
        begin = time.perf_counter()
        more = (*args.more, *(() if cluster is None else ("--cluster", cluster.address)))
        process = start(args.entry, f"0:{args.timed}", Path(name) / "out", workers, NONE, more)
        _, status, own = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        process.returncode = status
        assert status == 0
        return wall, own.ru_utime + own.ru_stime + used(cluster) - before


def used(cluster: Loopback | None) -> float:
    """CPU seconds of a cluster's processes so far."""
    some = [] if cluster is None else [cluster.scheduler, *cluster.workers]
    return sum(sum(psutil.Process(p.pid).cpu_times()[:2]) for p in some)


def compare(args: argparse.Namespace, work: Path) -> None:
    (work / "a").mkdir()
    (work / "b").mkdir()
    with loopback(work / "a", 1) as one, loopback(work / "b", 2) as two:
        ways = {"1 process": (1, None), "2 processes": (2, None), "1 worker": (1, one), "2 workers": (1, two)}
        for cluster in (one, two):  # kernels and imports
            timed(argparse.Namespace(**{**vars(args), "timed": 8}), 1, cluster)
        found = [{way: timed(args, *how) for way, how in ways.items()} for _ in range(args.rounds)]
    print(f"\n{args.timed} sequences, {args.rounds} rounds in turn, best; load {os.getloadavg()[0]:.1f}")
    print("| | wall s | CPU s |\n|---|---|---|")
    best = {way: [min(f[way][k] for f in found) for k in (0, 1)] for way in ways}
    for way, (wall, cpu) in best.items():
        print(f"| {way} | {wall:.1f} | {cpu:.1f} |")
    for slow, fast in (("1 process", "2 processes"), ("1 worker", "2 workers"), ("1 process", "2 workers")):
        each = ", ".join(f"{f[slow][0] / f[fast][0]:.2f}" for f in found)
        possible = 2 * best[slow][1] / best[fast][1]
        ratio = best[slow][0] / best[fast][0]
        print(f"{fast} against {slow}: x{ratio:.2f} (rounds: {each}), by CPU time at most x{possible:.2f}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sequences", type=int, default=1000)
    parser.add_argument("--entry", nargs="+", default=["side-by-side"])
    parser.add_argument("--set", nargs="*", default=["duration=4"])
    parser.add_argument("--rounds", type=int, default=0)
    parser.add_argument("--timed", type=int, default=100)
    args = parser.parse_args()
    args.more = [word for text in args.set for word in ("--set", text)]
    good = True
    with tempfile.TemporaryDirectory() as name:
        if args.sequences:
            good = prove(args, Path(name))
            print("the same" if good else "DIFFERENT", flush=True)
        if args.rounds:
            compare(args, Path(name))
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
