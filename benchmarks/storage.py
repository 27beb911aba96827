"""What pictures cost on the disk: CPU seconds and MB of a stored sequence, and reading it back, by streams and images.

    PYTHONPATH=. python benchmarks/storage.py [--entry merge crowd] [--repeats 3]

Each is the best of so many runs of `generate` in this process, one sequence at a time, kernels warm; `make` is all of
it (simulation, drawing, encoding, writing), `read` a pass over the stored frames.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from sim.dataset.generate import generate
from sim.io.source import open_source

KINDS = (
    ("none", (), "jpg"),
    ("left, jpg", ("left",), "jpg"),
    ("left, png", ("left",), "png"),
    ("left, mp4", ("left",), "mp4"),
    ("left + ids, jpg", ("left", "ids"), "jpg"),
)


def megabytes(folder: Path) -> float:
    return sum(p.stat().st_size for p in folder.rglob("*") if p.is_file()) / 1e6


def once(entry: str, streams: tuple[str, ...], images: str, out: Path) -> tuple[float, float, float, float]:
    """CPU seconds to make, MB, ms to open, ms per frame to read."""
    t0 = time.process_time()
    (folder,) = generate([entry], range(1), out, streams=streams, images=images)
    t1 = time.process_time()
    (sequence,) = open_source(folder)
    t2 = time.process_time()
    frames = sum(1 for _ in sequence)
    t3 = time.process_time()
    return t1 - t0, megabytes(folder), 1e3 * (t2 - t1), 1e3 * (t3 - t2) / frames


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--entry", nargs="+", default=["merge", "crowd"])
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    print("| scene | pictures | make, CPU s | MB | open, ms | read, ms/frame |\n|---|---|---|---|---|---|")
    for entry in args.entry:
        for name, streams, images in KINDS:
            runs = []
            for _ in range(args.repeats):
                with tempfile.TemporaryDirectory() as work:
                    runs.append(once(entry, streams, images, Path(work) / "out"))
            make, size, opened, read = (min(column) for column in zip(*runs, strict=True))
            print(f"| {entry} | {name} | {make:.2f} | {size:.1f} | {opened:.0f} | {read:.2f} |", flush=True)


if __name__ == "__main__":
    main()
