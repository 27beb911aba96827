"""Is a dataset the same however it is made? Content hashes and all bytes, over scenarios and ways of running.

    PYTHONPATH=. python benchmarks/hashes.py [--entry merge split …] [--seeds 0:2] [--streams left] [--images jpg mp4]

Every way is a `flockscope generate` of its own process (the first twice), but for one that makes all in this process
in the opposite order. With several kinds of images their content hashes must be equal too, and every truth hash that of
a run without pictures. Exit code 1 where anything differs.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from datasets import NONE, Pictures, content_hashes, file_bytes_hash, manifest_values, whole_run

from sim.dataset.generate import generate

ENTRIES = ("merge", "split", "cross", "queue", "pillar", "door", "stairs", "party", "clutter", "side-by-side")


def environment(threads: int = 1, hash_seed: int = 0, **more: str) -> dict[str, str]:
    """Variables of a run."""
    some = {"OMP_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads), "PYTHONHASHSEED": str(hash_seed)}
    return {**some, **more}


WAYS = {
    "1 worker": (1, environment()),
    "again": (1, environment()),
    "2 workers": (2, environment()),
    "OMP_NUM_THREADS=2": (1, environment(threads=2)),
    "PYTHONHASHSEED=12345": (1, environment(hash_seed=12345)),
    "2 workers, 4 threads, hash seed 7": (2, environment(threads=4, hash_seed=7)),
    "kernels compiled anew, another zone, C locale": (1, environment(TZ="Asia/Tokyo", LC_ALL="C", NUMBA_CACHE_DIR="")),
}
HERE = "in this process, backwards"


def made(way: str, args: argparse.Namespace, pictures: Pictures, work: Path) -> tuple[dict[str, str], str]:
    """Content hashes and the hash of all bytes."""
    out = work / "out"
    if way == HERE:
        low, high = map(int, args.seeds.split(":"))
        for entry in reversed(args.entry):
            streams = () if pictures.streams == "none" else pictures.streams.split(",")
            generate([entry], range(low, high), out, streams=streams, images=pictures.images)
    else:
        workers, variables = WAYS[way]
        if "NUMBA_CACHE_DIR" in variables:
            variables = {**variables, "NUMBA_CACHE_DIR": str(work / "cache")}
        whole_run(args.entry, args.seeds, out, workers, pictures, **variables)
    found = content_hashes(out), file_bytes_hash(out)
    shutil.rmtree(out)
    return found


def table(args: argparse.Namespace, pictures: Pictures, work: Path) -> tuple[bool, dict[str, str]]:
    """Print how the ways compare for one kind of pictures; whether all are the same, and the content hashes."""
    good, right = True, None
    print(f"streams {pictures.streams}, images {pictures.images}")
    print("| way | sequences | content hashes that differ | all bytes |\n|---|---|---|---|")
    for way in (*WAYS, HERE):
        hashes, everything = made(way, args, pictures, work)
        right = right or (hashes, everything)
        other = sorted(k for k in hashes.keys() | right[0].keys() if hashes.get(k) != right[0].get(k))
        same = everything == right[1]
        good &= same and not other
        print(f"| {way} | {len(hashes)} | {' '.join(other) or 'none'} | {'same' if same else 'DIFFER'} |", flush=True)
    assert right is not None
    return good, right[0]


def truths(args: argparse.Namespace, pictures: Pictures, work: Path) -> dict[str, str]:
    """Truth hash by name of sequence."""
    whole_run(args.entry, args.seeds, work / "out", 1, pictures)
    found = manifest_values(work / "out", "truth_hash")
    shutil.rmtree(work / "out")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--entry", nargs="+", default=list(ENTRIES))
    parser.add_argument("--seeds", default="0:2")
    parser.add_argument("--streams", default="none")
    parser.add_argument("--images", nargs="+", default=["jpg"])
    args = parser.parse_args()
    kinds = [Pictures(args.streams, images) for images in args.images]
    with tempfile.TemporaryDirectory() as name:
        found = [table(args, pictures, Path(name)) for pictures in kinds]
        good = all(same and hashes == found[0][1] for same, hashes in found)
        print(f"content hashes of {', '.join(args.images)}: {'equal' if good else 'see above, or DIFFERENT'}")
        if args.streams != "none":
            same = truths(args, kinds[0], Path(name)) == truths(args, NONE, Path(name))
            print(f"truth hashes with and without pictures: {'equal' if same else 'DIFFERENT'}")
            good &= same
    print("\nall the same" if good else "\nDIFFERENT")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
