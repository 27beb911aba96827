"""Steps per CPU second of the simulator beside JuPedSim, in the same open square with walls, at the same time step.

    PYTHONPATH=. python benchmarks/simulator.py --peer-python PYTHON [--rounds 5] [--people 21 99 999]

Ours: groups of three with goals across the square (0.2 people per m²), all forces, script, physics, and the state read
after every step; JuPedSim: the same starts and goals for each alone, its fastest model, positions read every step. Each
round times both in turn; the median ratio counts. The peer's interpreter needs `jupedsim` and nothing of ours.
Last column: our time over that of `pymunk.Space.step` alone in the same motion (aim: 2). Building scenes is left out.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pymunk
import pymunk.batch

from scenarios.schema.scenario import Scenario
from sim.crowd.forces import Steering
from sim.crowd.world import WRITE, World

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


class RecordingSpace(pymunk.Space):
    """A space that remembers the forces it was given."""

    def step(self, dt: float) -> None:
        """As pymunk's, after a look at the forces."""
        self.forces.append(self.force.copy())
        super().step(dt)


def episodes(people: int) -> int:
    """How often the same is done in one measurement."""
    return max(1, MOST // people)


def entered(people: int) -> tuple[World, Iterator]:
    """A world with everybody in it, and its further frames."""
    world = World(scenario(people), 0, 0, Steering())
    frames = world.frames(round(SECONDS * world.fps))
    next(frames)
    return world, frames


def ours(people: int) -> float:
    """Steps per CPU second."""
    steps, seconds = 0, 0.0
    for _ in range(episodes(people)):
        world, frames = entered(people)
        begin = time.process_time()
        count = sum(len(state) == people for state, _ in frames)
        seconds += time.process_time() - begin
        steps += count * world.substeps
    return steps / seconds


def physics(people: int) -> float:
    """Steps per CPU second of `Space.step` alone: the same forces, with and without steps."""
    world, frames = entered(people)
    world.space.__class__, world.space.forces, world.space.force = RecordingSpace, [], world.force
    for _ in frames:
        pass
    seconds = {True: 0.0, False: 0.0}
    for stepping in list(seconds) * episodes(people):
        again, _ = entered(people)
        begin = time.process_time()
        for force in world.space.forces:
            again.force[:] = force
            pymunk.batch.set_space_bodies(again.space, WRITE, again._write_buffer)
            if stepping:
                again.space.step(again.dt)
        seconds[stepping] += time.process_time() - begin
    return episodes(people) * len(world.space.forces) / (seconds[True] - seconds[False])


def layout(people: int) -> str:
    """What the peer is given: the same people, each on his own way."""
    world = World(scenario(people), 0, 0, Steering())
    scene = {"start": [], "goal": [], "speed": []}
    for party in world.entering:
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
            rates.append([ours(people), peer(args.peer_python, scene), physics(people)])
        mine, theirs, engine = np.array(rates).T
        ratio = mine / theirs
        print(
            f"| {people} | {np.median(mine):.0f} | {np.median(theirs):.0f} "
            f"| {np.median(ratio):.1f} ({ratio.min():.1f}-{ratio.max():.1f}) | {np.median(engine / mine):.1f} |",
            flush=True,
        )
        good &= bool(np.median(ratio) >= MUST)
    print(f"must be {MUST:g} each, aim {AIM:g}: {'reached' if good else 'MISSED'}")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
