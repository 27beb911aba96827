"""Steps per CPU second of the simulator beside JuPedSim, in the same open square with walls, at the same time step.

    python -m benchmarks.simulator --peer-python PYTHON [--rounds 5] [--people 21 99 999 2997]

Ours: groups of three with goals across the square (0.2 people per m²), all forces, script and physics; the state is
read after every step. JuPedSim: the same starts and goals for each person alone, its fastest model, positions read
after every step. Its interpreter PYTHON needs `jupedsim` and nothing of ours (benchmarks/peers/run_jupedsim.py).
Columns: median steps per CPU second of both, the median ratio of the rounds and its range, and our time divided by that
of `pymunk.Space.step` alone on the same motion (aim: 2). Each round times both in turn; making the scene is not timed.
At last the CPU seconds in which a world of 9,999 people is set up (must: 1). Exit code 1 if a median is below MUST.
"""

from __future__ import annotations

import json
import math
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pymunk
import pymunk.batch

from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row
from scenarios.schema.scenario import Scenario
from sim.clock import SCRIPT_RATE, STEPS
from sim.crowd.world import STEP_TIME, WRITE, World

RUNNER = Path(__file__).parent / "peers" / "run_jupedsim.py"
DENSITY = 0.2  # people per m²
MARGIN = 5.0  # m from the square to its wall
SECONDS = 6.0
MOST = 1000  # people in all episodes of one measurement: few people take too short a time to be measured once
MUST, AIM = 2.0, 3.0


def scenario(people: int, seed: int = 0) -> Scenario:
    """Returns a scenario of groups of three on a jittered grid, each walking to the opposite point of the square."""
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
    """A space that records the forces of each step in `forces`. State: `force`, the array that the world writes."""

    def step(self, dt: float) -> None:
        """Records a copy of the forces, then does the step of pymunk."""
        self.forces.append(self.force.copy())
        super().step(dt)


def episodes(people: int) -> int:
    """Returns how many equal episodes one measurement has."""
    return max(1, MOST // people)


def populated_world(people: int) -> tuple[World, Iterator]:
    """Returns a world after its first frame, in which everybody is present, and its further frames."""
    world = World(scenario(people), 0, 0)
    frames = world.ticks(round(SECONDS * SCRIPT_RATE))
    next(frames)
    return world, frames


def our_rate(people: int) -> float:
    """Returns the steps per CPU second of our simulator."""
    steps, seconds = 0, 0.0
    for _ in range(episodes(people)):
        _, frames = populated_world(people)
        begin = time.process_time()
        count = sum(len(state) == people for state, _ in frames)
        seconds += time.process_time() - begin
        steps += count * STEPS
    return steps / seconds


def physics_rate(people: int) -> float:
    """Returns the steps per CPU second of `Space.step` alone.

    The recorded forces are applied again with and without steps; the difference of the times counts.
    """
    world, frames = populated_world(people)
    world.space.__class__, world.space.forces, world.space.force = RecordingSpace, [], world.force
    for _ in frames:
        pass
    seconds = {True: 0.0, False: 0.0}
    for stepping in list(seconds) * episodes(people):
        again, _ = populated_world(people)
        begin = time.process_time()
        for force in world.space.forces:
            again.force[:] = force
            pymunk.batch.set_space_bodies(again.space, WRITE, again._write_buffer)
            if stepping:
                again.space.step(STEP_TIME)
        seconds[stepping] += time.process_time() - begin
    return episodes(people) * len(world.space.forces) / (seconds[True] - seconds[False])


def peer_input(people: int) -> str:
    """Returns the same people as JSON for the peer, each with a start, goal and speed of their own."""
    world = World(scenario(people), 0, 0)
    scene = {"start": [], "goal": [], "speed": []}
    for group in world.entering:
        for member, pos in zip(group.members, group.pos.tolist(), strict=True):
            scene["start"].append(pos)
            scene["goal"].append((np.array(pos) - group.start + group.goal).tolist())
            scene["speed"].append(member.free_speed)
    size = float(world.scene.size[0])
    steps = round(SECONDS / STEP_TIME)
    more = {"size": size, "margin": MARGIN, "dt": STEP_TIME, "steps": steps, "episodes": episodes(people)}
    return json.dumps({**scene, **more})


def peer_rate(python: str, scene: str) -> float:
    """Returns the steps per CPU second of JuPedSim."""
    answer = subprocess.run([python, RUNNER], input=scene, capture_output=True, text=True, check=True)
    found = json.loads(answer.stdout.splitlines()[-1])
    return float(found["steps"] / found["seconds"])


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--peer-python", required=True, help="interpreter of an environment with jupedsim")
    parser.add_argument("--people", nargs="+", type=int, default=[21, 99, 999, 2997])
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    our_rate(21)  # compiles the kernels
    crowd = scenario(9999)
    head(["people", "ours, steps per CPU s", "JuPedSim", "ratio (range)", "time / Space.step"])
    good = True
    for people in args.people:
        scene, rates = peer_input(people), []
        for _ in range(args.rounds):
            rates.append([our_rate(people), peer_rate(args.peer_python, scene), physics_rate(people)])
        ours, peer, engine = np.array(rates).T
        ratio = ours / peer
        row(
            [str(people), f"{np.median(ours):.0f}", f"{np.median(peer):.0f}",
             f"{np.median(ratio):.1f} ({ratio.min():.1f}-{ratio.max():.1f})", f"{np.median(engine / ours):.1f}"]
        )  # fmt: skip
        good &= bool(np.median(ratio) >= MUST)
    begin = time.process_time()
    World(crowd, 0, 0)
    print(f"9,999 people are set up in {time.process_time() - begin:.1f} CPU s")
    print(f"must be {MUST:g} each, aim {AIM:g}: {'reached' if good else 'MISSED'}")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
