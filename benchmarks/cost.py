"""What datasets cost: CPU seconds, bytes and files of a sequence, speed-up by workers.

    python -m benchmarks.cost sequences [--entry merge queue pillar crowd] [--seeds 0:1] [--repeats 1]
        [--sequences 1000000] [--cores 1000]
    python -m benchmarks.cost workers [--entry crowd] [--seeds 0:32] [--set duration=4] [--rounds 3]

sequences: every entry with every seed is made in this process, kernels warm, with several kinds of pictures. Columns,
per sequence, each the best of --repeats runs: CPU seconds to make it (simulate, draw, encode, write), to check it (the
same command again, which reads every byte) and to pack it into tar shards; MB, files, MB in a shard; ms to open it and
ms per frame to read it back. A second table multiplies the means over all entries by --sequences; its column `hours`
divides the core hours by --cores.
workers: one process and two make the same dataset in turn. Columns: wall and CPU seconds, best of the rounds, and MB of
the largest process. CPU seconds and memory are those of all processes that work; starting them counts, so the seeds
must be many. "By CPU time at most" is 2 CPU_1 / CPU_2, what two idle cores could give. Memory must not grow with the
number of sequences: a quarter of the seeds is made, too. Exit code 1 below MUST times the speed, or above GROWTH times
the memory.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.support.generate_runs import GenerateRun, measured
from benchmarks.support.options import add_seeds, new_parser, seeds_text
from benchmarks.support.tables import head, row
from benchmarks.support.timing import machine_load
from sim.dataset.generate import generate
from tracking.export.webdataset import webdataset
from tracking.recordings.source import open_source

MUST, AIM = 1.7, 1.9  # times the speed of one worker
GROWTH = 1.1  # times the memory
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
KINDS = (
    ("none", (), "jpg"),
    ("left, jpg", ("left",), "jpg"),
    ("left, png", ("left",), "png"),
    ("left, mp4", ("left",), "mp4"),
    ("left and ids, jpg", ("left", "ids"), "jpg"),
)
COLUMNS = "make, CPU s", "check, CPU s", "export, CPU s", "MB", "files", "MB in a shard", "open, ms", "read, ms/frame"
MAKE, CHECK, EXPORT, MB, FILES, SHARD_MB, OPEN, READ = range(8)


def cpu_seconds(steps: Iterable[object]) -> Iterator[tuple[float, object]]:
    """Yields the CPU seconds that each step of a generator takes, and its result."""
    begun = time.process_time()
    for result in steps:
        yield time.process_time() - begun, result
        begun = time.process_time()


def sequence_cost(entry: str, seeds: range, streams: tuple[str, ...], images: str) -> np.ndarray:
    """Returns the values of COLUMNS for one entry, means over its sequences."""
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "data"

        def steps() -> Iterator[object]:
            made = generate([entry], seeds, out, streams=streams, images=images)
            yield made
            yield generate([entry], seeds, out, streams=streams, images=images)
            yield webdataset(out, Path(name) / "shards")
            opened = [open_source(folder)[0] for folder in made]
            yield opened
            yield sum(1 for sequence in opened for _ in sequence)

        seconds, results = zip(*cpu_seconds(steps()), strict=True)
        made, _, index, _, frames = results
        sizes = [p.stat().st_size for folder in made for p in folder.rglob("*") if p.is_file()]
        packed = sum(shard["bytes"] for shard in index["shards"])
        make, check, export, opening, reading = seconds
        total = (make, check, export, sum(sizes) / 1e6, len(sizes), packed / 1e6, 1e3 * opening)
        return np.array([*(v / len(made) for v in total), 1e3 * reading / frames])


def sequences(args: argparse.Namespace) -> int:
    seeds = args.seeds or range(1)
    entries = args.entry or ["merge", "queue", "pillar", "crowd"]
    with tempfile.TemporaryDirectory() as name:
        generate(entries, seeds[:1], name, streams=("left",))  # compiles the kernels
    print(f"seeds {seeds_text(seeds)}; {machine_load()}")
    head(["scene", "pictures", *COLUMNS])
    means = {}
    for kind, streams, images in KINDS:
        costs = [
            np.min([sequence_cost(entry, seeds, streams, images) for _ in range(args.repeats)], axis=0)
            for entry in entries
        ]
        means[kind] = np.mean(costs, axis=0)
        for scene, cost in zip([*entries, "mean"], [*costs, means[kind]], strict=True):
            row([scene, kind, *(f"{v:.{digits}f}" for v, digits in zip(cost, (2, 3, 3, 2, 0, 2, 0, 2), strict=True))])
    n, cores = args.sequences, args.cores
    print(f"\n{n} sequences, {cores} cores, computed from the means above")
    head(["pictures", "core hours", "hours", "TB", "million files", "1 GB shards", "check all again, core hours"])
    for kind, cost in means.items():
        hours = n * cost[MAKE] / 3600
        cells = [f"{hours:.0f}", f"{hours / cores:.2f}", f"{n * cost[MB] / 1e6:.2f}", f"{n * cost[FILES] / 1e6:.0f}"]
        row([kind, *cells, f"{n * cost[SHARD_MB] / 1e3:.0f}", f"{n * cost[CHECK] / 3600:.0f}"])
    return 0


def way_cost(run: GenerateRun, count: int) -> tuple[float, float, float]:
    """Returns wall seconds, CPU seconds of all processes, and MB of the largest, of a dataset by `count` workers."""
    with tempfile.TemporaryDirectory() as name:
        begun = time.perf_counter()
        cpu, memory = measured(replace(run, workers=count).start(Path(name) / "out"))
        return time.perf_counter() - begun, cpu, memory


def workers(args: argparse.Namespace) -> int:
    seeds = args.seeds or range(32)
    more = [word for text in args.set for word in ("--set", text)]
    run = GenerateRun(args.entry or ["crowd"], seeds_text(seeds), more=more, env=ONE_THREAD)
    first, quarter = seeds[:1], seeds[: max(1, len(seeds) // 4)]
    ways = {"1 process": 1, "2 processes": 2}
    for count in ways.values():
        way_cost(replace(run, seeds=seeds_text(first)), count)  # compiles the kernels, imports
    found = [{name: way_cost(run, count) for name, count in ways.items()} for _ in range(args.rounds)]
    few = way_cost(replace(run, seeds=seeds_text(quarter)), 1)
    best = {name: np.min([f[name] for f in found], axis=0) for name in ways}
    print(f"{', '.join(run.entries)}, seeds {run.seeds}; {machine_load()}")
    head(["", "wall s (best)", "CPU s (best)", "MB of the largest process"])
    for name, (wall, cpu, memory) in [*best.items(), ("1 process, a quarter of the seeds", few)]:
        row([name, f"{wall:.1f}", f"{cpu:.1f}", f"{memory:.0f}"])
    each = ", ".join(f"{f['1 process'][0] / f['2 processes'][0]:.2f}" for f in found)
    possible = 2 * best["1 process"][1] / best["2 processes"][1]
    print(f"speed-up by rounds: {each}; by CPU time at most {possible:.2f}")
    growth = best["1 process"][2] / few[2]
    print(f"memory with four times the sequences: x{growth:.2f}; must be at most {GROWTH}")
    speed_up = best["1 process"][0] / best["2 processes"][0]
    print(f"speed-up {speed_up:.2f}; must be {MUST}, aim {AIM}")
    return 0 if speed_up >= MUST and growth <= GROWTH else 1


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["sequences", "workers"])
    parser.add_argument("--entry", nargs="+")
    add_seeds(parser, None, what="sequences 0:1, workers 0:32; ")
    parser.add_argument("--repeats", type=int, default=1, help="sequences: runs of which the best counts")
    parser.add_argument("--sequences", type=int, default=1_000_000, help="sequences: size of the planned dataset")
    parser.add_argument("--cores", type=int, default=1000, help="sequences: cores that make it")
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE", help="workers: settings of the scenarios")
    parser.add_argument("--rounds", type=int, default=3, help="workers: rounds, both in turn")
    args = parser.parse_args()
    return {"sequences": sequences, "workers": workers}[args.mode](args)


if __name__ == "__main__":
    raise SystemExit(main())
