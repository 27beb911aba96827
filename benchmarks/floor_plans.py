"""Does everybody find the way? Random floor plans, and the same ones in JuPedSim.

    python -m benchmarks.floor_plans --peer-python PYTHON [--seeds 20000:20040]

A plan has 2 × 1 to 4 × 3 rooms with a door of 0.9 to 3 m in each wall between two rooms, up to 6 pillars, and 20 to
120 people in groups of 1 to 6, who come within 20 s and walk from a room to another. The same people start at the same
places and times in JuPedSim, alone, as it has no groups. Its interpreter PYTHON needs `jupedsim`, `shapely` and nothing
of ours (benchmarks/peers/run_floor_plans.py).
Columns, over all plans: people; share that has arrived within 150 s (must: 99.5 %); people who were within 0.5 m for
more than 15 s (must: 0), and the longest such time; steps through walls; seconds until the last has arrived, median of
the plans in which all do; CPU seconds. Exit code 1 if too few of ours arrive, or one crosses a wall.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import head, row
from scenarios.loading.validation import validate
from scenarios.schema.scenario import Scenario
from sim.clock import SCRIPT_RATE
from sim.crowd.navigation import scene_of
from sim.crowd.population import draw_population
from sim.crowd.world import World
from sim.geometry.walls import blocked
from sim.types import Array

RUNNER = Path(__file__).parent / "peers" / "run_floor_plans.py"
MODELS = {
    "collision-free speed": 0.05, "generalised centrifugal force": 0.01, "social force": 0.01,
    "anticipation velocity": 0.05,
}  # fmt: skip
SECONDS, SHORTEST, MUST = 150.0, 15.0, 0.995
MOVE = 0.5  # m
ROOM_X, ROOM_Y = (6.0, 12.0), (5.0, 10.0)  # m: least and greatest sides of a room


def plan(seed: int) -> Scenario:
    """Returns the plan of a seed with its people."""
    r = np.random.default_rng([seed, 63])
    counts = (ROOM_X, r.integers(2, 5)), (ROOM_Y, r.integers(1, 4))
    x, y = (np.cumsum([0, *r.uniform(*size, count)]).round(1) for size, count in counts)
    walls, doors = [], []
    for across, along, axis in ((x, y, 0), (y, x, 1)):
        for at in across[1:-1].tolist():
            ends = [[at, at], [0.0, float(along[-1])]]
            (x1, x2), (y1, y2) = ends if axis == 0 else ends[::-1]
            walls.append([x1, y1, x2, y2])
            for low, high in pairwise(along.tolist()):
                width = r.uniform(0.9, min(3.0, high - low - 1.6))
                middle = r.uniform(low + 0.8 + width / 2, high - 0.8 - width / 2)
                place = [at, round(float(middle), 2)]
                doors.append({"at": place if axis == 0 else place[::-1], "width": round(float(width), 2)})
    rooms = [(i, j) for i in range(len(x) - 1) for j in range(len(y) - 1)]

    def inside(room: tuple[int, int], margin: float) -> list[tuple[float, float]]:
        return [(float(a[k] + margin), float(a[k + 1] - margin)) for a, k in zip((x, y), room, strict=True)]

    pillars: list[list[float]] = []
    for _ in range(r.integers(0, 7)):
        radius = float(r.uniform(0.2, 0.6))
        place = [float(r.uniform(*span)) for span in inside(rooms[r.integers(len(rooms))], 1.8 + radius)]
        if all(np.hypot(place[0] - a, place[1] - b) > radius + c + 1.2 for a, b, c in pillars):
            pillars.append([round(value, 2) for value in (*place, radius)])
    people, groups = int(r.integers(20, 121)), list[dict[str, Any]]()
    while people:
        size = min(int(r.integers(1, 7)), people)
        people -= size
        start, end = (rooms[k] for k in r.permutation(len(rooms))[:2])
        goal = [0.0, 0.0]
        while goal == [0.0, 0.0] or any(np.hypot(goal[0] - a, goal[1] - b) <= c + 1.0 for a, b, c in pillars):
            goal = [round(float(r.uniform(*span)), 2) for span in inside(end, 1.5)]
        groups.append(
            {"id": f"g{len(groups)}", "size": size, "start": [{"uniform": span} for span in inside(start, 1.2)],
             "goal": goal, "at_goal": "leave", "enter": round(float(r.uniform(0, 20)), 1)}
        )  # fmt: skip
    world = {"size": [float(x[-1]), float(y[-1])], "walls": walls, "doors": doors, "pillars": pillars}
    camera = {"kind": "top", "fps": 5, "px_per_m": 10}
    table = {"schema": 1, "about": "", "duration": SECONDS, "world": world, "camera": camera, "group": groups}
    return validate(table, f"plan {seed}", model=Scenario)


@dataclass(frozen=True)
class Outcome:
    """What became of the people of one plan. Times in s."""

    people: int
    left: int  # who have not arrived at the end
    still: list[float]  # longest time of each person within MOVE
    crossed: int  # steps through walls
    last: float  # at which the last has arrived
    cpu: float


def standing_times(pos: Array, rate: float) -> list[float]:
    """Returns the longest time, s, for which each person stays within MOVE. pos (C, P, 2): m, nan while absent."""
    times = []
    for p in range(pos.shape[1]):
        path = pos[np.isfinite(pos[:, p, 0]), p].tolist()
        first = longest = 0
        for k, (a, b) in enumerate(path):
            while (a - path[first][0]) ** 2 + (b - path[first][1]) ** 2 > MOVE * MOVE:
                first += 1
            longest = max(longest, k - first)
        times.append(longest / rate)
    return times


def ours(seed: int) -> Outcome:
    """Returns the outcome of a plan in our simulator."""
    scenario = plan(seed)
    begin = time.process_time()
    motion = World(scenario, seed, 0).run()
    cpu = time.process_time() - begin
    pos = motion.states().pos
    a, b = pos[:-1].reshape(-1, 2), pos[1:].reshape(-1, 2)
    there = np.isfinite(a[:, 0]) & np.isfinite(b[:, 0])
    crossed = int(blocked(a[there], b[there], motion.scene.walls).sum())
    present = np.isfinite(pos[..., 0])
    last = float(np.flatnonzero(present.any(axis=1))[-1]) / SCRIPT_RATE
    return Outcome(pos.shape[1], int(present[-1].sum()), standing_times(pos, SCRIPT_RATE), crossed, last, cpu)


def peer_input(seed: int) -> dict[str, Any]:
    """Returns the same plan and people as values for JSON."""
    scenario = plan(seed)
    scene = scene_of(scenario.world)
    people = [
        {"enter": g.enter, "start": pos, "goal": g.goal.tolist(), "speed": member.free_speed}
        for g in draw_population(scenario, scene, seed, 0)
        for member, pos in zip(g.members, g.pos.tolist(), strict=True)
    ]
    walls, pillars = np.reshape(scene.walls, (-1, 4)).tolist(), np.reshape(scene.pillars, (-1, 3)).tolist()
    return {"size": scene.size.tolist(), "walls": walls, "pillars": pillars, "people": people, "seconds": SECONDS}


def peers(python: str, model: str, plans: list[dict[str, Any]]) -> list[Outcome]:
    """Returns the outcomes of plans in one model of JuPedSim; a plan that it refuses is left out, with a word."""
    given = json.dumps({"model": model, "dt": MODELS[model], "move": MOVE, "plans": plans})
    answer = subprocess.run([python, RUNNER], input=given, capture_output=True, text=True, check=True)
    found = [json.loads(line) for line in answer.stdout.splitlines() if line.startswith("{")]
    for values in found:
        if "refused" in values:
            print(f"{model}: a plan is left out: {values['refused']}", file=sys.stderr)
    return [Outcome(**values) for values in found if "refused" not in values]


def print_row(name: str, outcomes: list[Outcome]) -> float:
    """Prints the row of a simulator; returns the share that has arrived."""
    people = sum(o.people for o in outcomes)
    share = 1 - sum(o.left for o in outcomes) / people
    still = [t for o in outcomes for t in o.still]
    done = [o.last for o in outcomes if not o.left]
    row(
        [name, str(len(outcomes)), str(people), f"{100 * share:.2f} %", str(sum(t > SHORTEST for t in still)),
         f"{max(still):.0f}", str(sum(o.crossed for o in outcomes)), f"{np.median(done):.0f}" if done else "–",
         f"{sum(o.cpu for o in outcomes):.0f}"]
    )  # fmt: skip
    return share


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--peer-python", required=True, help="interpreter of an environment with jupedsim, shapely")
    add_seeds(parser, "20000:20040")
    args = parser.parse_args()
    ours(args.seeds[0])  # compiles the kernels
    found = [ours(seed) for seed in args.seeds]
    titles = ["simulator", "plans", "people", "arrive", f"still for {SHORTEST:g} s", "longest, s", "through walls"]
    head([*titles, "last arrives, s", "CPU s"])
    share = print_row("flockscope", found)
    plans = [peer_input(seed) for seed in args.seeds]
    for model in MODELS:
        print_row(f"JuPedSim, {model}", peers(args.peer_python, model, plans))
    return int(share < MUST or any(o.crossed for o in found))


if __name__ == "__main__":
    raise SystemExit(main())
