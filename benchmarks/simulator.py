"""Steps per CPU second of the simulator beside JuPedSim, in the same open square with walls, at the same time step.

    PYTHONPATH=. python benchmarks/simulator.py --peer-python PYTHON [--rounds 5] [--people 21 99 999]

Ours: groups of three with goals across the square (0.2 people per m²), all forces, script, physics, and the state read
after every step; JuPedSim: the same starts and goals for each alone, its fastest model, positions read every step. Each
round times both in turn; the median ratio counts. The peer's interpreter needs `jupedsim` and nothing of ours.
Last column: our time over that of `pymunk.Space.step` alone in the same motion. Building the scene is left out.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import time
from pathlib import Path

import numpy as np
import pymunk

from scenarios.schema import Scenario
from sim.steering import Steering
from sim.world import World

RUNNER = Path(__file__).parent / "peers" / "run_jupedsim.py"
DENSITY = 0.2  # people per m²
MARGIN = 5.0  # m from the square to its wall
SECONDS = 6.0
MOST = 1000  # people in all episodes of one measurement: few people take too short a time to be measured once
MUST, AIM = 2.0, 3.0


def scenario(people: int, seed: int = 0) -> Scenario:
    """Groups of three on a jittered grid, each on its way to the point opposite."""
    r, side = np.random.default_rng(seed), math.sqrt(people / DENSITY)
    k = math.ceil(math.sqrt(people / 3))
    grid = np.stack(np.meshgrid(*2 * [(np.arange(k) + 0.5) / k * side]), -1).reshape(-1, 2)
    starts = r.permutation(grid)[: people // 3] + r.uniform(-0.3, 0.3, (people // 3, 2))
    low, high = -MARGIN, side + MARGIN
    corners = [(low, low), (high, low), (high, high), (low, high)]
    walls = [(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    groups = [
        {"id": f"g{n}", "size": 3, "start": p.tolist(), "goal": (side - p).tolist()} for n, p in enumerate(starts)
    ]
    world = {"size": [side, side], "walls": walls}
    return Scenario.model_validate(
        {"schema": 1, "duration": SECONDS, "warmup": 0.0, "world": world, "camera": {"kind": "top"}, "group": groups}
    )


class TimedSpace(pymunk.Space):
    """A space that knows how long its steps took."""

    seconds = 0.0

    def step(self, dt: float) -> None:
        """As pymunk's, timed."""
        begin = time.perf_counter()
        super().step(dt)
        self.seconds += time.perf_counter() - begin


def episodes(people: int) -> int:
    """How often the same is done in one measurement."""
    return max(1, MOST // people)


def ours(people: int) -> float:
    """Steps per CPU second."""
    script = scenario(people)
    times = [_timed(World(script, 0, 0, Steering()), time.process_time) for _ in range(episodes(people))]
    return sum(steps for steps, _ in times) / sum(seconds for _, seconds in times)


def physics_share(people: int) -> float:
    """Time of everything over that of the physics engine's steps alone."""
    world = World(scenario(people), 0, 0, Steering())
    world.space.__class__ = TimedSpace
    return _timed(world, time.perf_counter)[1] / world.space.seconds


def _timed(world: World, clock) -> tuple[int, float]:
    frames = world.frames(round(SECONDS * world.fps))
    next(frames)
    begin, count = clock(), 0
    for state, _ in frames:
        count += 1
        assert len(state) == len(world.members)
    return count * world.substeps, clock() - begin


def layout(people: int) -> str:
    """What the peer is given: the same people, each on his own way."""
    world = World(scenario(people), 0, 0, Steering())
    scene = {"start": [], "goal": [], "speed": []}
    for party in world.parties:
        for member, pos in zip(party.members, party.pos.tolist(), strict=True):
            scene["start"].append(pos)
            scene["goal"].append((np.array(pos) - party.start + party.goal).tolist())
            scene["speed"].append(member.free_speed)
    size = float(world.scene.size[0])
    steps = round(SECONDS / world.dt)
    more = {"size": size, "margin": MARGIN, "dt": world.dt, "steps": steps, "episodes": episodes(people)}
    return json.dumps({**scene, **more})


def peer(python: str, scene: str) -> float:
    """The same of JuPedSim."""
    answer = subprocess.run([python, RUNNER], input=scene, capture_output=True, text=True, check=True)
    said = json.loads(answer.stdout.splitlines()[-1])
    return float(said["steps"] / said["seconds"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peer-python", required=True, help="interpreter of an environment with jupedsim")
    parser.add_argument("--people", nargs="+", type=int, default=[21, 99, 999])
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    ours(21)  # compiles the kernels
    print("| people | ours, steps per CPU s | JuPedSim | ratio (range) | time / Space.step |\n|---|---|---|---|---|")
    good = True
    for people in args.people:
        scene, rates = layout(people), []
        for _ in range(args.rounds):
            rates.append([ours(people), peer(args.peer_python, scene)])
        mine, theirs = np.array(rates).T
        ratio = mine / theirs
        share = np.median([physics_share(people) for _ in range(args.rounds)])
        print(
            f"| {people} | {np.median(mine):.0f} | {np.median(theirs):.0f} "
            f"| {np.median(ratio):.1f} ({ratio.min():.1f}-{ratio.max():.1f}) | {share:.1f} |",
            flush=True,
        )
        good &= bool(np.median(ratio) >= MUST)
    print(f"must be {MUST:g} each, aim {AIM:g}: {'reached' if good else 'MISSED'}")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
