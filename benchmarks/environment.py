"""What an episode costs beside its tracking, and how fast the environment steps.

    PYTHONPATH=. OMP_NUM_THREADS=1 python benchmarks/environment.py [trial] [steps] [memory] [--rounds 5] [--peer P]

trial: a tuning trial, 4 sequences of 200 frames and 20 people on average (the crowd, boxes), played with what was kept
of the trial before, for every registered tracker, and its tracking alone. Limits (design): `blob` 0.5 s, and any
tracker 1.15 times its tracking time; exit code 1 beyond. --peer: the Python of an environment for
benchmarks/peers/tune_roboflow.py, which plays a trial of roboflow's tuner (SORT, HOTA) on the same boxes. steps: steps
and episodes per second on `crossing`, one action for a whole episode or every 10 frames, in one environment, and in
vectors of two, in this process and in two. memory: what the cache holds, and the process, while many sequences are
played under a small limit. CPU time of the process, but for vectors, whose wall time depends on the machine's load,
which is printed; the best of several rounds.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
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
from benchmarks.blob_vs_peers import write_mot
from sim.io.store.truth_files import truth_files
from tracking.environment.episode_cache import OpenedSource
from tracking.environment.episodes import Rollout, Source, SourceCache, play, sources
from tracking.environment.observation import Observer
from tracking.prepare import PreparedTracker, prepare
from tracking.tracker_registry import names

MUST, AIM, SHARE = 0.5, 0.2, 1.15
PEOPLE = ["group.passers.repeat=2", "group.stop.repeat=3"]
EVERY = (None, 10)
ID = "flockscope/Tuning-v0"
PEER = Path(__file__).parent / "peers" / "tune_roboflow.py"


def best(run: Callable[[], Any], rounds: int, clock: Callable[[], float] = time.process_time) -> float:
    """Seconds of the quickest of several runs, after one that is not counted."""
    run()
    found = []
    for _ in range(rounds):
        begun = clock()
        run()
        found.append(clock() - begun)
    return min(found)


def track_alone(tracker: str, opened: OpenedSource) -> None:
    """The tracker on the same detections, and nothing else."""
    ready = prepare(tracker, opened.sequence)
    ready.reset(0)
    for frame in ready.frames():
        ready.step(frame)


def boxes_alone(source: Source) -> Source:
    """The same boxes without a camera: tracked and scored in the image, as by the peers."""
    return sources(dataclasses.replace(source.open(), camera=None))[0]


def peer_trial(python: str, flat: tuple[Source, ...], rounds: int) -> None:
    """Print what a trial of roboflow's tuner costs on the same boxes."""
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
    print(f"| roboflow's tuner, SORT | – | {found['seconds']:.3f} | – |  (HOTA {found['best']:.3f} at best)")


def trial(rounds: int, peer: str | None) -> bool:
    """Print the figures of a trial; are they within the limits?"""
    chosen, cache = sources("crowd", range(4), PEOPLE), SourceCache()
    truths = [cache.open(source).truth for source in chosen]
    people = np.mean([len(t.frame) / t.length for t in truths])
    print(f"\ntrial: {len(chosen)} x {truths[0].length} frames, {people:.1f} people on average; CPU seconds")
    print("| tracker | tracking | trial | ratio |\n|---|---|---|---|")
    flat = tuple(boxes_alone(source) for source in chosen)
    rows = [("blob", "blob, no camera", flat), *((name, name, chosen) for name in names())]
    good = True
    for tracker, title, some in rows:
        calls = [
            (partial(track_alone, tracker, cache.open(one)), partial(play, tracker, one, cache=cache)) for one in some
        ]
        times = np.full((len(some), 2, rounds), np.inf)
        for k in range(rounds):  # in turn: others share the machine
            for i, pair in enumerate(calls):
                times[i, :, k] = [best(call, 1) for call in pair]
        alone, whole = times.min(axis=2).sum(axis=0)
        ratio = whole / alone
        print(f"| {title} | {alone:.3f} | {whole:.3f} | {ratio:.2f} |", flush=True)
        good &= ratio <= SHARE and (tracker != "blob" or whole <= MUST)
    if peer is not None:
        peer_trial(peer, flat, rounds)
    print(f"must: blob {MUST} s (aim {AIM}), ratio {SHARE}")
    return good


def made(tracker: str, every: int | None, **options: Any) -> dict[str, Any]:
    return {"tracker": tracker, "suite": "crossing", "seeds": range(2), "decision_every": every, **options}


def episode(env: gymnasium.Env[Any, Any]) -> int:
    """Play an episode with the middle of the space; its steps."""
    env.reset()
    action, steps, done = np.zeros(env.action_space.shape or (), np.float32), 0, False
    while not done:
        *_, done, _, _ = env.step(action)
        steps += 1
    return steps


def steps(rounds: int) -> None:
    """Print steps and episodes per second, and where an environment's time goes."""
    print("\nsteps: `crossing`, 160 frames, 5 to 7 people; share of an environment's CPU time")
    print("| tracker | action every | steps/s | episodes/s | tracking | scoring | observing |")
    print("|---|---|---|---|---|---|---|")
    for name in names():
        for every in EVERY:
            env = gymnasium.make(ID, **made(name, every))
            env.reset(seed=0)
            for _ in range(8):
                episode(env)  # all sequences are opened
            spent, count, parts = measured(env, rounds)
            tracked, scored, observed = (100 * part / spent for part in parts)
            rates = f"{count / spent:.1f} | {8 * rounds / spent:.1f}"
            print(f"| {name} | {every} | {rates} | {tracked:.0f} % | {scored:.0f} % | {observed:.0f} % |", flush=True)
    print("\nvectors of 2, wall time\n| tracker | action every | sync steps/s | async steps/s |\n|---|---|---|---|")
    for name in names():
        for every in EVERY:
            found = [vector(name, every, mode, rounds) for mode in ("sync", "async")]
            print(f"| {name} | {every} | {found[0]:.1f} | {found[1]:.1f} |", flush=True)


def measured(env: gymnasium.Env[Any, Any], rounds: int) -> tuple[float, int, list[float]]:
    """CPU seconds and steps of 8 episodes a round, and the seconds in tracking, scoring and observing."""
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
    """Steps per second of both environments together."""
    at_once = {"autoreset_mode": gymnasium.vector.AutoresetMode.SAME_STEP}  # else the step after an end plays nothing
    envs = gymnasium.make_vec(ID, 2, vectorization_mode=mode, vector_kwargs=at_once, **made(name, every))
    try:
        envs.reset(seed=0)
        zero = np.zeros(envs.action_space.shape or (), np.float32)
        some = 8 if every is None else 40

        def run() -> None:
            for _ in range(some):
                envs.step(zero)

        run()
        return 2 * some / best(run, rounds, time.perf_counter)
    finally:
        envs.close()


def memory() -> bool:
    """Print what is held while 60 sequences are played under a small limit; does it stay there?"""
    limit = 4 * 2**20
    cache, found = SourceCache(limit), []
    for k, source in enumerate(sources("crowd", range(60), PEOPLE), 1):
        play("blob", source, cache=cache)
        if k in (1, 10, 20, 40, 60):
            rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            found.append((k, len(cache), cache.bytes / 2**20, rss))
    print(f"\nmemory: cache of {limit / 2**20:.0f} MiB\n| played | held | MiB held | MB of the process, at most |")
    print("|---|---|---|---|")
    for k, held, size, rss in found:
        print(f"| {k} | {held} | {size:.1f} | {rss:.0f} |")
    one = found[0][2]
    return all(size <= limit / 2**20 + one * 2 for _, _, size, _ in found)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", choices=["trial", "steps", "memory", []], default=[])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--peer", metavar="PYTHON", help="of the environment that roboflow trackers and optuna are in")
    options = parser.parse_args()
    what = options.what or ["trial", "steps", "memory"]
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    good = True
    if "trial" in what:
        good &= trial(options.rounds, options.peer)
    if "steps" in what:
        steps(options.rounds)
    if "memory" in what:
        good &= memory()
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
