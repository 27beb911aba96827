"""How fast this tree is beside an earlier commit: a row for each path that users wait for.

    python -m benchmarks beside [--commit HASH] [--rounds 11] [--paths "scoring" "simulator"]

The commit, by default that of `beside.toml`, is checked out in a temporary worktree. One process for each tree makes
the same inputs, runs every path once to compile its kernels, then runs the paths in turn with the other process. Only
CPU time of the path counts. The ratio of a round is this tree's time over the commit's; shown are the median and its
interval of 99 % (order statistics; with fewer rounds all ratios). A path is slower if the median is above SLOWER and
the interval is above SURELY; it is then measured a second time, and only if it is slower again the exit code is 1. A
path that the commit cannot run is left out.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
SLOWER, SURELY = 1.10, 1.05
ROUNDS = 11  # The median lies outside the second to the tenth of 11 ratios by a chance of 1.2 %.

Work = Callable[[], object]


def stepping(name: str, people: int, count: int, area: float = 4.0) -> Work:
    """Returns the tracking of people who walk to and fro, seen as boxes ("blob") or points on the ground."""
    from sim.types import Context, Detections, Frame
    from tracking.running.tracker_registry import find

    random, boxed = np.random.default_rng(0), name == "blob"
    place, velocity = (random.uniform(low, high, (people, 2)) for low, high in ((0, np.sqrt(people * area)), (-1, 1)))
    frames = []
    for k in range(1, count + 1):
        pos = (place + velocity * k / 10 + random.normal(0, 0.05, place.shape)) * (40.0 if boxed else 1.0)
        box = np.column_stack([pos - [10, 34], np.tile([20.0, 68.0], (people, 1))]) if boxed else None
        plane = "image" if boxed else "ground"
        frames.append(Frame(k, k / 10, detections=Detections(k, k / 10, plane, pos, None, box, np.ones(people))))
    tracker = find(name)()

    def work() -> None:
        tracker.reset(Context(10.0, 40.0 if boxed else float("nan")), 0)
        for frame in frames:
            tracker.step(frame, frame.detections)

    return work


def seeing(name: str, streams: tuple[str, ...], count: int) -> Work:
    """Returns the tracking of pictures, drawn before."""
    import scenarios
    import sim
    from sim.types import Context
    from tracking.running.tracker_registry import find

    sequence = sim.simulate(scenarios.load("crowd", [f"duration={count / 10}"]), 0, streams=(*streams, "background"))
    frames, tracker = list(sequence), find(name)()
    known = sequence.px_per_m, sequence.camera, sequence.scene, sequence.image_size, sequence.background()[:10]

    def work() -> None:
        tracker.reset(Context(sequence.fps, *known), 0)
        for frame in frames:
            tracker.step(frame, None)

    return work


def drawing() -> Work:
    import scenarios
    import sim

    streams = "left", "ids", "disparity"
    sequence = sim.simulate(scenarios.load("crowd", ["duration=3"]), 0, streams=streams)
    return lambda: [sequence.load_pixels and sequence.load_pixels(frame.index) for frame in sequence]


def simulating() -> Work:
    import scenarios
    import sim

    crowd = scenarios.load("crowd")
    return lambda: [sim.simulate(crowd, seed, streams=()) for seed in range(3)]


def playing() -> Work:
    from tracking.episodes.episode import SourceCache, play, sources

    every, cache = sources("quick", range(1))[:4], SourceCache(2**30)
    return lambda: [play("blob", source, detections="file", cache=cache) for source in every]


def scoring() -> Work:
    import scenarios
    import sim
    import tracking

    sequence = sim.simulate(scenarios.load("crowd"), 0, streams=())
    run = tracking.track("blob", sequence, detections="file")
    return lambda: [tracking.evaluate(sequence.truth, run) for _ in range(4)]


PATHS: dict[str, Callable[[], Work]] = {
    "blob, boxes, 20 people": lambda: stepping("blob", 20, 400),
    "blob, boxes, 100 people": lambda: stepping("blob", 100, 200),
    "blob, pixels": lambda: seeing("blob", ("left",), 40),
    "stereo, pixels": lambda: seeing("stereo", ("left", "right"), 20),
    "group-pda, 110 points": lambda: stepping("group-pda", 110, 30, 25.0),
    "drawing with ids and disparity": drawing,
    "simulator": simulating,
    "a trial of 4 episodes": playing,
    "scoring": scoring,
}


def serve() -> None:
    """Answers each line that names a path with the CPU seconds that it takes, or with "none" and why."""
    made = dict[str, Work]()
    for line in sys.stdin:
        name, answer = line.strip(), ""
        try:
            if name not in made:
                made[name] = PATHS[name]()
                made[name]()
            begun = time.process_time()
            made[name]()
            answer = repr(time.process_time() - begun)
        except Exception as error:
            answer = f"none {type(error).__name__}: {error}".replace("\n", " ")
        print(f"beside {answer}", flush=True)


@contextmanager
def tree_of(commit: str) -> Iterator[Path]:
    """Context manager: yields a temporary worktree of the commit."""
    with tempfile.TemporaryDirectory() as name:
        git = ["git", "-C", str(ROOT), "worktree"]
        tree = Path(name) / "tree"
        subprocess.run([*git, "add", "-q", "--detach", str(tree), commit], check=True)
        try:
            yield tree
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


@contextmanager
def runner(tree: Path) -> Iterator[Callable[[str], float]]:
    """Context manager: yields a function that runs a path on the code of `tree`: CPU seconds, nan if it cannot."""
    env = {**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    child = subprocess.Popen(
        [sys.executable, "-P", "-W", "ignore", __file__, "--serve"], env=env, cwd=tree, text=True, bufsize=1,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    assert child.stdin is not None
    assert child.stdout is not None

    def seconds(path: str) -> float:
        child.stdin.write(f"{path}\n")
        answer = next((line for line in child.stdout if line.startswith("beside ")), "none: the process ended")
        word = answer.removeprefix("beside ").strip()
        if word.startswith("none"):
            print(f"{path}, {tree}: {word}", file=sys.stderr)
            return float("nan")
        return float(word)

    try:
        yield seconds
    finally:
        child.stdin.close()
        child.wait()


def is_slower(ratios: list[float]) -> bool:
    """Returns True if the ratios of one path say that it has become slower."""
    low, middle, _ = ends(ratios)
    return low > SURELY and middle > SLOWER


def ends(ratios: list[float]) -> tuple[float, float, float]:
    """Returns the lower end of the interval of the median, the median, and the upper end."""
    rows = sorted(ratios)
    outer = int(len(rows) >= ROUNDS)
    return rows[outer], float(np.median(rows)), rows[-1 - outer]


def slower_paths(commit: str, rounds: int, paths: list[str]) -> list[str]:
    """Prints the table; returns the paths that are slower than at the commit in both measurements."""
    with tree_of(commit) as tree, runner(ROOT) as here, runner(tree) as there:

        def ratios(path: str) -> list[float]:
            # Who is first takes turns: what one run leaves in the cache of the processor is no advantage.
            found = [[run(path) for run in ((here, there) if k % 2 else (there, here))] for k in range(rounds)]
            return [a / b if k % 2 else b / a for k, (a, b) in enumerate(found)]

        slower = []
        print(f"| time over that of {commit[:8]} | median | interval |\n|---|---|---|")
        for path in paths:
            if np.isnan(here(path) + there(path)):
                print(f"| {path} | not measured | |")
                continue
            measured = ratios(path)
            if is_slower(measured):
                measured = ratios(path)
                slower += [path] if is_slower(measured) else []
            low, middle, high = ends(measured)
            print(f"| {path} | {middle:.3f} | {low:.3f} to {high:.3f} |", flush=True)
        return slower


def base() -> str:
    """Returns the commit that last closed an issue."""
    return str(tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["commit"])


def is_known(commit: str) -> bool:
    """Returns True if this is a clone that has the commit."""
    asked = ["git", "-C", str(ROOT), "cat-file", "-e", f"{commit}^{{commit}}"]
    return subprocess.run(asked, capture_output=True, check=False).returncode == 0


def main() -> int:
    from benchmarks.support.options import new_parser

    parser = new_parser(__doc__)
    parser.add_argument("--commit", default=base())
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("--paths", nargs="+", default=[*PATHS], choices=[*PATHS], metavar="PATH")
    args = parser.parse_args()
    slower = slower_paths(args.commit, args.rounds, args.paths)
    print(f"slower than {SLOWER} times: {', '.join(slower) or 'none'}")
    return int(bool(slower))


if __name__ == "__main__":
    raise SystemExit(serve() if sys.argv[1:] == ["--serve"] else main())
