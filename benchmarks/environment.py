"""What an episode costs beside its tracking, how fast the environment steps, and what its cache holds.

    python -m benchmarks.environment [trial] [steps] [memory] [--rounds 5] [--peer-python PYTHON]

trial: a tuning trial of 4 sequences of 200 frames and 20 people on average (`crowd`, boxes) that the cache holds, for
every registered tracker. Columns: CPU seconds of the tracking alone and of the trial, and their ratio. Limits: MUST
seconds for `blob`, RATIO times its tracking for any tracker; exit code 1 beyond. With --peer-python, an environment
for benchmarks/peers/tune_roboflow.py, also a trial of roboflow's tuner (SORT, HOTA) on the same boxes.
steps: steps and episodes per second on `crossing`, one action for a whole episode or every 10 frames. First table: one
environment, CPU time, and the shares of tracking, scoring and observing. Second: vectors of two environments, in this
process and in two processes, wall time, which depends on the load of the machine.
memory: sequences and MiB that a small cache holds, and MB of the process, while 60 sequences are played. Exit code 1 if
the cache exceeds its limit by more than two sequences. All times are the best of --rounds.
"""

from __future__ import annotations

import dataclasses
import json
import resource
import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from unittest import mock

import gymnasium
import numpy as np

import tracking  # noqa: F401  (registers the environment)
from benchmarks.blob.boxes import write_mot
from benchmarks.support.options import new_parser, one_thread
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_times, machine_load
from sim.io.store.truth_files import truth_files
from tracking.environment.episode_cache import OpenedSource
from tracking.environment.episodes import Rollout, Source, SourceCache, play, sources
from tracking.environment.observation import Observer
from tracking.prepare import PreparedTracker, prepare
from tracking.tracker_registry import names

MUST, AIM, RATIO = 0.5, 0.2, 1.15  # s of a trial of `blob`, s, and times the tracking alone
PEOPLE = ["group.passers.repeat=2", "group.stop.repeat=3"]
EVERY = (None, 10)
ID = "flockscope/Tuning-v0"
PEER = Path(__file__).parent / "peers" / "tune_roboflow.py"


def best_cpu(run: Callable[[], Any], rounds: int) -> float:
    """Returns the least CPU seconds of several runs, after one that is not counted."""
    run()
    return best_times(run, rounds)[0]


def track_alone(tracker: str, opened: OpenedSource) -> None:
    """Runs the tracker on the detections of an open source, without groups and scores."""
    ready = prepare(tracker, opened.sequence)
    ready.reset(0)
    for frame in ready.frames():
        ready.step(frame)


def boxes_alone(source: Source) -> Source:
    """Returns the source without its camera: tracked and scored in the image, as the peers do."""
    return sources(dataclasses.replace(source.open(), camera=None))[0]


def peer_trial(python: str, flat: tuple[Source, ...], rounds: int) -> None:
    """Prints what a trial of roboflow's tuner costs on the same boxes."""
    with tempfile.TemporaryDirectory() as place:
        for name in ("gt", "det"):
            (Path(place) / name).mkdir()
        for k, source in enumerate(flat):
            sequence = source.open()
            write_mot(sequence, Path(place) / "det" / f"{k}.txt")
            assert sequence.truth is not None
            (Path(place) / "gt" / f"{k}.txt").write_bytes(truth_files(sequence.truth)["gt/gt.txt"])
        call = [python, str(PEER), place, "sort", str(rounds)]
        found = json.loads(subprocess.run(call, capture_output=True, text=True, check=True).stdout.splitlines()[-1])
    row(["roboflow's tuner, SORT", "–", f"{found['seconds']:.3f}", "–"])
    print(f"best HOTA of roboflow's tuner: {found['best']:.3f}")


def trial(rounds: int, peer: str | None) -> bool:
    """Prints the table of a trial; returns True if all trackers keep the limits."""
    chosen, cache = sources("crowd", range(4), PEOPLE), SourceCache()
    truths = [cache.open(source).truth for source in chosen]
    people = np.mean([len(t.frame) / t.length for t in truths])
    print(f"\ntrial: {len(chosen)} x {truths[0].length} frames, {people:.1f} people on average; CPU seconds")
    head(["tracker", "tracking", "trial", "ratio"])
    flat = tuple(boxes_alone(source) for source in chosen)
    rows = [("blob", "blob, no camera", flat), *((name, name, chosen) for name in names())]
    good = True
    for tracker, title, some in rows:
        calls = [
            (partial(track_alone, tracker, cache.open(one)), partial(play, tracker, one, cache=cache)) for one in some
        ]
        times = np.full((len(some), 2, rounds), np.inf)
        for k in range(rounds):  # in turn, because other programs share the machine
            for i, pair in enumerate(calls):
                times[i, :, k] = [best_cpu(call, 1) for call in pair]
        alone, whole = times.min(axis=2).sum(axis=0)
        ratio = whole / alone
        row([title, f"{alone:.3f}", f"{whole:.3f}", f"{ratio:.2f}"])
        good &= ratio <= RATIO and (tracker != "blob" or whole <= MUST)
    if peer is not None:
        peer_trial(peer, flat, rounds)
    print(f"must: blob {MUST} s (aim {AIM}), ratio {RATIO}")
    return good


def keywords(tracker: str, every: int | None, **options: Any) -> dict[str, Any]:
    return {"tracker": tracker, "suite": "crossing", "seeds": range(2), "decision_every": every, **options}


def episode(env: gymnasium.Env[Any, Any]) -> int:
    """Plays an episode with the centre of the action space; returns its number of steps."""
    env.reset()
    action, steps, done = np.zeros(env.action_space.shape or (), np.float32), 0, False
    while not done:
        *_, done, _, _ = env.step(action)
        steps += 1
    return steps


def steps(rounds: int) -> None:
    """Prints steps and episodes per second, and where the time of an environment goes."""
    print("\nsteps: `crossing`, 160 frames, 5 to 7 people; share of an environment's CPU time")
    head(["tracker", "action every", "steps/s", "episodes/s", "tracking", "scoring", "observing"])
    for name in names():
        for every in EVERY:
            env = gymnasium.make(ID, **keywords(name, every))
            env.reset(seed=0)
            for _ in range(8):
                episode(env)  # all sequences are opened
            spent, count, parts = measured(env, rounds)
            tracked, scored, observed = (100 * part / spent for part in parts)
            rates = f"{count / spent:.1f}", f"{8 * rounds / spent:.1f}"
            row([name, str(every), *rates, f"{tracked:.0f} %", f"{scored:.0f} %", f"{observed:.0f} %"])
    print("\nvectors of 2, wall time")
    head(["tracker", "action every", "steps/s, one process", "steps/s, two processes"])
    for name in names():
        for every in EVERY:
            found = [vector(name, every, mode, rounds) for mode in ("sync", "async")]
            row([name, str(every), f"{found[0]:.1f}", f"{found[1]:.1f}"])


def measured(env: gymnasium.Env[Any, Any], rounds: int) -> tuple[float, int, list[float]]:
    """Returns CPU seconds and steps of 8 episodes per round, and the seconds in tracking, scoring and observing."""
    parts = [0.0, 0.0, 0.0]

    def timed(k: int, call: Callable[..., Any]) -> Callable[..., Any]:
        def inner(*given: Any) -> Any:
            begun = time.process_time()
            try:
                return call(*given)
            finally:
                parts[k] += time.process_time() - begun

        return inner

    with (
        mock.patch.object(PreparedTracker, "step", timed(0, PreparedTracker.step)),
        mock.patch.object(Rollout, "scores", timed(1, Rollout.scores)),
        mock.patch.object(Observer, "add", timed(2, Observer.add)),
        mock.patch.object(Observer, "statistics", timed(2, Observer.statistics)),
    ):
        begun = time.process_time()
        count = sum(episode(env) for _ in range(8 * rounds))
        return time.process_time() - begun, count, parts


def vector(name: str, every: int | None, mode: str, rounds: int) -> float:
    """Returns the steps per wall second of both environments together."""
    at_once = {"autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP}
    envs = gymnasium.make_vec(ID, 2, vectorization_mode=mode, vector_kwargs=at_once, **keywords(name, every))
    try:
        envs.reset(seed=0)
        zero = np.zeros(envs.action_space.shape or (), np.float32)
        some = 8 if every is None else 40

        def run() -> None:
            for _ in range(some):
                envs.step(zero)

        best_times(run, 1)
        return 2 * some / best_times(run, rounds)[1]
    finally:
        envs.close()


def memory() -> bool:
    """Prints what the cache holds while 60 sequences are played; returns True if it keeps its limit."""
    limit = 4 * 2**20
    cache, found = SourceCache(limit), []
    for k, source in enumerate(sources("crowd", range(60), PEOPLE), 1):
        play("blob", source, cache=cache)
        if k in (1, 10, 20, 40, 60):
            rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            found.append((k, len(cache), cache.bytes / 2**20, rss))
    print(f"\nmemory: cache of {limit / 2**20:.0f} MiB")
    head(["played", "sequences held", "MiB held", "MB of the process, at most"])
    for k, held, size, rss in found:
        row([str(k), str(held), f"{size:.1f}", f"{rss:.0f}"])
    one = found[0][2]
    return all(size <= limit / 2**20 + one * 2 for _, _, size, _ in found)


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("what", nargs="*", choices=["trial", "steps", "memory", []], default=[], help="default: all")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--peer-python", metavar="PYTHON", help="trial: of an environment with `trackers` and `optuna`")
    options = parser.parse_intermixed_args()
    one_thread()
    what = options.what or ["trial", "steps", "memory"]
    print(machine_load())
    good = True
    if "trial" in what:
        good &= trial(options.rounds, options.peer_python)
    if "steps" in what:
        steps(options.rounds)
    if "memory" in what:
        good &= memory()
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
