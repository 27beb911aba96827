"""What a sequence costs, and so what many do: CPU seconds, bytes and files to make, check and export, by pictures.

    PYTHONPATH=. python benchmarks/scale.py [--entry merge queue pillar crowd] [--seeds 0:1]
        [--sequences 1000000] [--cores 1000] [--items 2000]

Every entry with every seed is made in this process, kernels warm, and the mean taken; `check` is what running the same
command again costs where a sequence is whole, `export` packing it into tar shards. From these the table of a plan for
--sequences on --cores is reckoned: measured on one machine, the rest is multiplication. Last, how many items a second a
scheduler on loopback gives to two workers and gets back, where the work itself is nothing: above that rate more workers
do not help.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from sim.dataset.generate import generate
from sim.io.export.webdataset import webdataset
from sim.workers.start import start_workers
from tests.errands import process
from tests.loopback import loopback

KINDS = (
    ("none", (), "jpg"),
    ("left, jpg", ("left",), "jpg"),
    ("left, mp4", ("left",), "mp4"),
    ("left and ids, jpg", ("left", "ids"), "jpg"),
)


@dataclass(frozen=True)
class Cost:
    """Of one sequence: CPU seconds to make, check again and export; bytes; files; bytes in a shard."""

    make: float
    check: float
    export: float
    bytes: float
    files: float
    packed: float


def cost(entries: list[str], seeds: range, streams: tuple[str, ...], images: str) -> Cost:
    with tempfile.TemporaryDirectory() as name:
        out, times = Path(name) / "data", [time.process_time()]
        made = generate(entries, seeds, out, streams=streams, images=images)
        times.append(time.process_time())
        generate(entries, seeds, out, streams=streams, images=images)
        times.append(time.process_time())
        index = webdataset(out, Path(name) / "shards")
        times.append(time.process_time())
        sizes = [p.stat().st_size for folder in made for p in folder.rglob("*") if p.is_file()]
        seconds = [(b - a) / len(made) for a, b in pairwise(times)]
        packed = sum(shard["bytes"] for shard in index["shards"])
        return Cost(*seconds, *(v / len(made) for v in (sum(sizes), len(sizes), packed)))


def rate(items: int) -> float:
    """Items a second that a cluster of two workers gets through, if there is nothing to do."""
    with (
        tempfile.TemporaryDirectory() as name,
        loopback(Path(name)) as cluster,
        start_workers(1, cluster.address) as run,
    ):
        list(run(process, range(20), ahead=20))
        begin = time.perf_counter()
        list(run(process, range(items), ahead=100))
        return items / (time.perf_counter() - begin)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--entry", nargs="+", default=["merge", "queue", "pillar", "crowd"])
    parser.add_argument("--seeds", default="0:1")
    parser.add_argument("--sequences", type=int, default=1_000_000)
    parser.add_argument("--cores", type=int, default=1000)
    parser.add_argument("--items", type=int, default=2000)
    args = parser.parse_args()
    low, high = map(int, args.seeds.split(":"))
    with tempfile.TemporaryDirectory() as name:
        generate(args.entry, range(low, low + 1), name, streams=("left",))  # compiles the kernels
    print(f"{', '.join(args.entry)}, seeds {args.seeds}; load {os.getloadavg()[0]:.1f}")
    print("| pictures | make, CPU s | check, CPU s | export, CPU s | MB | files | MB in a shard |")
    print("|---|---|---|---|---|---|---|")
    costs = {}
    for kind, streams, images in KINDS:
        c = costs[kind] = cost(args.entry, range(low, high), streams, images)
        row = f"{c.make:.2f} | {c.check:.3f} | {c.export:.3f} | {c.bytes / 1e6:.2f} | {c.files:.0f}"
        print(f"| {kind} | {row} | {c.packed / 1e6:.2f} |", flush=True)
    n, cores = args.sequences, args.cores
    print(f"\n{n} sequences, {cores} cores, reckoned from the above")
    print("| pictures | core hours | hours | TB | million files | 1 GB shards | check all again, core hours |")
    print("|---|---|---|---|---|---|---|")
    for kind, c in costs.items():
        hours = n * c.make / 3600
        row = f"{hours:.0f} | {hours / cores:.2f} | {n * c.bytes / 1e12:.2f} | {n * c.files / 1e6:.0f}"
        print(f"| {kind} | {row} | {n * c.packed / 1e9:.0f} | {n * c.check / 3600:.0f} |")
    if args.items:
        print(f"\na scheduler and two workers: {rate(args.items):.0f} items/s; load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
