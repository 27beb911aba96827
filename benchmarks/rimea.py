"""Tests that no one here wrote: the RiMEA guideline's and published experiments; with the same people in JuPedSim.

    python -m benchmarks rimea --peer-python PYTHON [--seeds 20000:20003] [--tests NUMBER …]

Numbers are those of the RiMEA guideline for microscopic evacuation analysis (3.0, 2016). Its plans are kept, with fewer
people; those of tests 9 and 15 are smaller, at the same density. PYTHON: as of `floor_plans`
(benchmarks/peers/run_rimea.py). Values are means over the seeds, ✓ and ✗ say whether they are as asked. People are
alone, in one column in groups of three. –: the model has no stairs. refused: JuPedSim stops, as the model pushes people
into walls. Left out, as they are about evacuation software: 8 (how a building's time depends on parameters), 11 and 14
(who takes a farther exit or way: in all models here everybody goes the shortest one).
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.floor_plans import MODELS
from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import head, row
from scenarios.loading.validation import validate
from scenarios.schema.scenario import Scenario
from sim.clock import SCRIPT_RATE
from sim.crowd.navigation import scene_of
from sim.crowd.world import World
from sim.geometry.walls import blocked
from sim.types import Array

RUNNER = Path(__file__).parent / "peers" / "run_rimea.py"
FREE, DEVIATION, UP, DOWN = 1.34, 0.26, 0.61, 0.69  # m/s: alone, and on stairs, over ground (Weidmann 1993)
CLEAR = 0.56  # m between people at the start
DENSITIES, WIDTHS = (0.5, 1.0, 2.0, 3.0), (0.8, 1.0, 1.2, 1.6, 2.0, 2.4)  # 1/m², m
Walls = list[list[float]]
Draws = np.random.Generator


class Plan(NamedTuple):
    """A floor plan, with the starts, goals (G, 2) m and times of entry (G,) s of its groups; walls (W, 2, 2) m."""

    scenario: Scenario
    start: Array
    goal: Array
    enter: Array
    walls: Array


def plan(
    r: Draws, size: tuple[float, float], walls: Walls, start: Array, goal: Any, seconds: float = 60.0,
    *, speed: float | None = None, enter: Any = 0.0, members: int = 1, **world: Any,
) -> Plan:  # fmt: skip
    """Returns a plan. goal, enter: of each group, or one for all; speed: None draws it; world: doors, stairs."""
    speeds = r.normal(FREE, DEVIATION, len(start)).clip(0.5, 2.2) if speed is None else np.full(len(start), speed)
    goals, enters = np.array(np.broadcast_to(goal, start.shape), float), np.array(np.broadcast_to(enter, speeds.shape))
    groups = [
        {"id": f"g{k}", "size": members, "start": a, "goal": b, "at_goal": "leave", "speed": v, "enter": t}
        for k, (a, b, v, t) in enumerate(zip(*(x.tolist() for x in (start, goals, speeds, enters)), strict=True))
    ]
    table = {"schema": 1, "duration": seconds, "warmup": 0.0, "crowd": {"spacing": 0.7}, "group": groups}
    table["camera"] = {"kind": "top", "fps": SCRIPT_RATE, "px_per_m": 10, "crop": True}
    scenario = validate({**table, "world": {"size": list(size), "walls": walls, **world}}, "plan", model=Scenario)
    return Plan(scenario, start, goals, enters, np.reshape(scene_of(scenario.world).walls, (-1, 2, 2)))


def places(r: Draws, x1: float, y1: float, x2: float, y2: float, people: int, members: int = 1) -> Array:
    """Returns the starts (G, 2) of people spread over a box; groups of three are side by side along y."""
    wide, high = x2 - x1, y2 - y1
    rows = int(high / (2.0 if members > 1 else np.sqrt(wide * high / people)) + 1e-9)
    columns = int(wide) if members > 1 else -(-people // rows)
    cells = r.permutation(rows * columns)[: -(-people // members)]
    free = np.maximum(np.array([wide / columns, high / rows]) - CLEAR, 0.0) / 2 * (members == 1)
    middle = np.column_stack([x1 + (cells // rows + 0.5) * wide / columns, y1 + (cells % rows + 0.5) * high / rows])
    return np.asarray(middle + free * r.uniform(-1, 1, middle.shape))


def beyond(start: Array, x: float, low: float, high: float) -> Array:
    """Returns goals (G, 2) at x, straight ahead of the starts, at whole metres between low and high."""
    return np.column_stack([np.full(len(start), x), np.round(start[:, 1]).clip(low, high)])


def sides(x1: float, y1: float, x2: float, y2: float) -> Walls:
    """Returns the walls of a room."""
    return [[x1, y1, x2, y1], [x1, y2, x2, y2], [x1, y1, x1, y2], [x2, y1, x2, y2]]


def doors(width: float, *places: tuple[float, float]) -> list[dict[str, Any]]:
    return [{"at": list(at), "width": width} for at in places]


def corridor(speed: float, foot: float, top: float, share: float, r: Draws, n: int) -> Plan:
    flight = {"foot": [foot, 2], "head": [top, 2], "width": 2, "rise": 5, "slowdown": share}
    walls, start = [[0, 1, 50, 1], [0, 3, 50, 3]], np.array([[2.0, 2]])
    return plan(r, (50, 4), walls, start, (48, 2), speed=speed, stairs=[flight] if share < 1 else [])


def filled(r: Draws, n: int, density: float) -> Plan:
    start = places(r, 1, 0.5, 41, 3.5, round(120 * density))
    return plan(r, (70, 4), [[0, 0.5, 70, 0.5], [0, 3.5, 70, 3.5]], start, beyond(start, 68, 1, 3), 10.0)


def premovement(r: Draws, n: int) -> Plan:
    start, enter = places(r, 1, 1, 9, 6, 10), np.arange(10.0, 101, 10)
    return plan(r, (13, 7), sides(1, 1, 9, 6), start, (11, 3.5), 120.0, enter=enter, doors=doors(1, (9, 3.5)))


def corner(r: Draws, n: int) -> Plan:
    walls = [[1, 1, 13, 1], [13, 1, 13, 14], [1, 3, 11, 3], [11, 3, 11, 14], [1, 1, 1, 3]]
    return plan(r, (14, 14), walls, places(r, 1, 1, 11, 3, 20), (12, 12.5))


def lanes(r: Draws, n: int) -> Plan:
    start = np.column_stack([np.full(60, 2.0), 2.0 + 2 * np.arange(60)])
    return plan(r, (40, 124), [], start, beyond(start, 38, 0, 124), 80.0)


def exits(r: Draws, n: int, count: int) -> Plan:
    at, start = np.array([[5, 3], [13, 3], [5, 11], [13, 11]])[:count], places(r, 3, 3, 15, 11, 160)
    nearest = at[np.linalg.norm(start[:, None] - at, axis=2).argmin(axis=1)]
    goal = nearest + [0, 1.8] * np.sign(nearest - 7)
    return plan(r, (18, 14), sides(3, 3, 15, 11), start, goal, 150.0, doors=doors(1, *at.tolist()))


def cabins(r: Draws, n: int) -> Plan:
    walls: Walls = [[x, 7, x, 12] for x in (1, 4, 7, 8.2, 10, 13, 16, 19)]
    walls += [[1, 6, 1, 7]] + [[x, 1, x, 6] for x in range(1, 20, 3)]
    walls += [[x1, y, x2, y] for y in (7, 12) for x1, x2 in ((1, 7), (8.2, 19))] + [[1, y, 19, y] for y in (1, 6)]
    rooms = [(x, 7) for x in (2.5, 5.5, 9.1, 11.5, 14.5, 17.5)] + [(x, 6) for x in np.arange(2.5, 20, 3).tolist()]
    start = np.array([(x, {7: 8.7, 6: 4.3}[y] + 1.6 * (k - (y == 6))) for x, y in rooms for k in (0, 1)][:-1])
    goal = np.where(np.isin(np.arange(23) // 2, (0, 1, 2, 3, 6, 7, 8, 9))[:, None], [7.6, 13.5], [21.0, 6.5])
    return plan(r, (23, 15), walls, start, goal, 90.0, doors=doors(0.9, *rooms))


def two_rooms(r: Draws, n: int) -> Plan:
    walls = [*sides(1, 1, 11, 11), *sides(16, 1, 26, 11), [11, 5.5, 16, 5.5], [11, 6.5, 16, 6.5]]
    start, gates = places(r, 1, 1, 11, 11, 60, n), doors(1, (11, 6), (16, 6), (26, 6))
    return plan(r, (31, 12), walls, start, (29, 6), 100.0, doors=gates, members=n)


def stairs_ahead(r: Draws, n: int) -> Plan:
    walls, start = [*sides(1, 1, 6, 9), [6, 4, 24, 4], [6, 6, 24, 6]], places(r, 1, 1, 6, 9, 100)
    stairs = [{"foot": [18, 5], "head": [21, 5], "width": 2, "rise": 1.7, "slowdown": UP / FREE}]
    return plan(r, (28, 10), walls, start, (25.5, 5), 120.0, doors=doors(2, (6, 5)), stairs=stairs)


def wide(r: Draws, n: int, length: float) -> Plan:
    start, end = places(r, 1, 1, 11, 11, 125, n), length + 4
    walls = [[1, 1, 1, 11], [1, 1, end, 1], [1, 11, end, 11]]
    return plan(r, (end, 12), walls, start, beyond(start, end - 1, 2, 10), 100.0, members=n)


def wide_corner(r: Draws, n: int) -> Plan:
    start = places(r, 1, 1, 11, 11, 125, n)
    walls = [[1, 1, 1, 11], [1, 11, 21, 11], [21, 11, 21, 20], [1, 1, 26, 1], [26, 1, 31, 6], [31, 6, 31, 20]]
    goal = np.column_stack([32 - beyond(start, 0, 2, 10)[:, 1], np.full(len(start), 18.0)])
    return plan(r, (32, 20), walls, start, goal, 100.0, members=n)


def bottleneck(r: Draws, n: int, width: float) -> Plan:
    start, gates = places(r, 1, 1, 11, 10, 60, n), doors(width, (11, 5.5))
    return plan(r, (18, 11), sides(1, 1, 11, 10), start, beyond(start, 16, 2, 9), 90.0, doors=gates, members=n)


def counterflow(r: Draws, n: int) -> Plan:
    a, b = places(r, 2, 1, 12, 5, 40), places(r, 20, 1, 30, 5, 40)
    goal = np.concatenate([beyond(a, 30.5, 2, 4), beyond(b, 1.5, 2, 4)])
    return plan(r, (32, 6), [[0, 1, 32, 1], [0, 5, 32, 5]], np.concatenate([a, b]), goal, 90.0)


def passing(pos: Array, at: float) -> Array:
    """Returns when each person of pos (T, P, 2) is first at or beyond x = `at` m, s; inf for never."""
    there = pos[..., 0] >= at
    return np.where(there.any(axis=0), there.argmax(axis=0) / SCRIPT_RATE, np.inf)


def flow(pos: Array, at: float) -> float:
    """Returns the people per s who pass x = at, between the first and the last tenth of them."""
    times = np.sort(passing(pos, at))
    first = len(times) // 10
    between = times[-1 - first] - times[first] if np.isfinite(times[first]) else np.inf
    return float((len(times) - 1 - 2 * first) / between)


def pace(pos: Array, x1: float, x2: float, y1: float = -np.inf, y2: float = np.inf) -> float:
    """Returns the mean speed, m/s, of people in a box."""
    speed, here = np.linalg.norm(np.diff(pos, axis=0), axis=2) * SCRIPT_RATE, pos[:-1]
    inside = (here[..., 0] > x1) & (here[..., 0] < x2) & (here[..., 1] > y1) & (here[..., 1] < y2)
    return float(np.nanmean(speed[inside])) if inside.any() else np.nan


def arrived(pos: Array) -> float:
    """Returns the share of people who have come and gone, %."""
    there = np.isfinite(pos[..., 0])
    return float(100 * np.mean(there.any(axis=0) & ~there[-1]))


def last(pos: Array) -> float:
    """Returns when nobody is left, s; inf for never."""
    ticks = np.flatnonzero(np.isfinite(pos[..., 0]).any(axis=1))
    return float(ticks[-1] / SCRIPT_RATE) if arrived(pos) == 100 else np.inf


def through_walls(plan: Plan, pos: Array) -> int:
    a, b = pos[:-1].reshape(-1, 2), pos[1:].reshape(-1, 2)
    there = np.isfinite(a[:, 0]) & np.isfinite(b[:, 0])
    return int(blocked(a[there], b[there], plan.walls).sum())


def started(plan: Plan, pos: Array) -> float:
    """Returns the longest time, s, from the entry until a person has walked 0.2 m."""
    return float(np.max((np.linalg.norm(pos - plan.start, axis=2) > 0.2).argmax(axis=0) / SCRIPT_RATE - plan.enter))


def weidmann(density: float) -> float:
    """Returns Weidmann's mean speed, m/s, at a density, 1/m²."""
    return float(FREE * (1 - np.exp(-1.913 * (1 / density - 1 / 5.4))))


def diagram(pos: Array) -> list[float]:
    """Returns density, 1/m², and speed, m/s, in the middle of the full corridor, from 4 to 10 s."""
    x = pos[40:, :, 0]
    return [float(((x > 17) & (x < 25)).sum() / len(x) / 24), pace(pos[40:], 17, 25)]


def order(pos: Array) -> float:
    """Returns how far two streams have parted into lanes 1 m wide: 0 as at random, 1 in full."""
    found, right = [], np.arange(pos.shape[1]) < pos.shape[1] // 2
    for here in pos:
        inside = (here[:, 0] > 10) & (here[:, 0] < 22)
        lane = np.floor(here[inside, 1] - 1).astype(int).clip(0, 3)
        a, b = (np.bincount(lane[right[inside] == side], minlength=4) for side in (True, False))
        if min(a.sum(), b.sum()) >= 8:
            chance = ((a + b) > 0).sum() / (a + b).sum()
            found.append((((a - b) ** 2 / np.maximum(a + b, 1)).sum() / (a + b).sum() - chance) / (1 - chance))
    return float(np.mean(found)) if found else np.nan


def gap(pos: Array) -> float:
    """Returns the longest time, s, in which nobody passes the door, before the last tenth of the people."""
    times = np.minimum(np.sort(passing(pos, 11.2))[: pos.shape[1] * 9 // 10], len(pos) / SCRIPT_RATE)
    return float(np.diff(times).max())


def allocated(plan: Plan, pos: Array) -> float:
    """Returns the share of people whose last place is at their own exit, %."""
    end = len(pos) - 1 - np.isfinite(pos[::-1, :, 0]).argmax(axis=0)
    return float(100 * np.mean(np.linalg.norm(pos[end, np.arange(len(end))] - plan.goal, axis=1) < 2))


class Test(NamedTuple):
    """A row of the table. measure: values of the paths in all scenes of one seed; passed: whether their means pass."""

    name: str
    asked: str
    scenes: tuple[Callable[[Draws, int], Plan], ...]
    measure: Callable[[list[Plan], list[Array]], list[float]]
    text: str
    passed: Callable[[Array], Any]
    columns: str = "alone, peers"


THREES = "alone, threes, peers"
FLIGHTS = tuple(partial(corridor, FREE, a, b, v / FREE) for a, b, v in ((18, 28, UP), (28, 18, DOWN)))
DOORS = tuple(partial(bottleneck, width=w) for w in WIDTHS)
# fmt: off
TESTS = (
    Test("1 speed in a corridor", "40 m at 1.33 m/s: 26 to 34 s", (partial(corridor, 1.33, 0, 0, 1),),
         lambda _, p: [passing(p[0], 44)[0] - passing(p[0], 4)[0]], "{0:.1f} s", lambda v: 26 <= v[0] <= 34),
    Test("2, 3 stairs up, down", f"10 m at {UP}, {DOWN} m/s: 14.3 to 18.5, 12.6 to 16.4 s", FLIGHTS,
         lambda _, p: [passing(one, 28)[0] - passing(one, 18)[0] for one in p], "{0:.1f}, {1:.1f} s",
         lambda v: 14.3 <= v[0] <= 18.5 and 12.6 <= v[1] <= 16.4, "alone"),
    Test("4 fundamental diagram, m/s at people per m²", "within 0.2 m/s of Weidmann, " + ", ".join(
        f"{weidmann(d):.2f} at {d:g}" for d in DENSITIES), tuple(partial(filled, density=d) for d in DENSITIES),
        lambda _, p: [x for one in p for x in diagram(one)],
        ", ".join(f"{{{2 * k + 1}:.2f}} at {{{2 * k}:.1f}}" for k in range(len(DENSITIES))),
        lambda v: all(abs(s - weidmann(d)) <= 0.2 for d, s in v.reshape(-1, 2))),
    Test("5 premovement times", "10 people who enter at 10 to 100 s walk within 1 s", (premovement,),
         lambda q, p: [started(q[0], p[0])], "{0:.1f} s", lambda v: v[0] <= 1),
    Test("6 round a corner", "all of 20 arrive, no step through walls", (corner,),
         lambda q, p: [arrived(p[0]), through_walls(q[0], p[0])], "{0:.0f} %, {1:.0f} steps",
         lambda v: v[0] == 100 and v[1] == 0),
    Test("7 speeds of a population", f"{FREE} ± {DEVIATION} m/s, both within 0.05", (lanes,),
         lambda _, p: [f(27 / (passing(p[0], 32) - passing(p[0], 5))) for f in (np.mean, np.std)],
         "{0:.2f} ± {1:.2f} m/s", lambda v: abs(v[0] - FREE) <= 0.05 and abs(v[1] - DEVIATION) <= 0.05),
    Test("9 four exits, then two", "twice the time (1.6 to 2.4)", (partial(exits, count=4), partial(exits, count=2)),
         lambda _, p: [last(p[0]), last(p[1]), last(p[1]) / last(p[0])], "{0:.0f}, {1:.0f} s: {2:.2f}",
         lambda v: 1.6 <= v[2] <= 2.4),
    Test("10 allocation of exits", "23 people of 12 rooms leave by the exit given to them", (cabins,),
         lambda q, p: [allocated(q[0], p[0])], "{0:.0f} %", lambda v: v[0] == 100),
    Test("12 two rooms in a row, m/s before both doors", "a jam before the first, none (0.7 m/s) before the second",
         (two_rooms,), lambda _, p: [pace(p[0], 8, 11, 4.5, 7.5), pace(p[0], 23, 26, 4.5, 7.5)],
         "{0:.2f}, {1:.2f}", lambda v: v[0] < 0.7 <= v[1], THREES),
    Test("13 jam before stairs", "flow on the stairs < in the corridor, a jam (0.7 m/s) before them", (stairs_ahead,),
         lambda _, p: [flow(p[0], 19), flow(p[0], 7), pace(p[0], 15, 18)],
         "{0:.2f} < {1:.2f} per s; {2:.2f} m/s", lambda v: v[0] < v[1] and v[2] < 0.7, "alone"),
    Test("15 many round a corner", "time between those of 25 and 40.5 m straight on",
         (partial(wide, length=25), wide_corner, partial(wide, length=40.5)),
         lambda _, p: [*map(last, p)],
         "{0:.0f}, {1:.0f}, {2:.0f} s", lambda v: v[0] < v[1] < v[2], THREES),
    Test(f"flow per m and s, doors of {', '.join(map(str, WIDTHS))} m", "1.2 to 2.2 (experiments)", DOORS,
         lambda _, p: [flow(one, 11.2) / w for one, w in zip(p, WIDTHS, strict=True)],
         ", ".join(f"{{{k}:.2f}}" for k in range(len(WIDTHS))), lambda v: np.all((v >= 1.2) & (v <= 2.2)), THREES),
    Test("no lasting arch, doors of 0.8 and 1 m", "all arrive, at most 5 s without a passage", DOORS[:2],
         lambda _, p: [gap(p[0]), gap(p[1]), min(map(arrived, p))], "{0:.1f}, {1:.1f} s, {2:.0f} %",
         lambda v: v[0] <= 5 and v[1] <= 5 and v[2] == 100, THREES),
    Test("counterflow of 40 and 40, corridor of 4 m", "all arrive; order of the lanes ≥ 0.5", (counterflow,),
         lambda _, p: [arrived(p[0]), order(p[0])], "{0:.0f} %, {1:.2f}", lambda v: v[0] == 100 and v[1] >= 0.5),
)
# fmt: on
Scene = Callable[[Draws, int], Plan]


@cache
def drawn(scene: Scene, seed: int, members: int) -> Plan:
    return scene(np.random.default_rng([seed, 64]), members)


@cache
def ours(scene: Scene, seed: int, members: int) -> Array:
    """Returns the paths (T, P, 2) of the people of a scene in our simulator, m; nan while absent."""
    return World(drawn(scene, seed, members).scenario, seed, 0).run().states().pos


def peer_input(plan: Plan) -> dict[str, Any]:
    """Returns a plan as values for JSON."""
    rows = zip(*(x.tolist() for x in (plan.start, plan.goal, plan.enter)), plan.scenario.group, strict=True)
    people = [{"start": a, "goal": b, "enter": t, "speed": group.speed} for a, b, t, group in rows]
    size, seconds = plan.scenario.world.size, plan.scenario.duration
    return {"size": size, "walls": plan.walls.reshape(-1, 4).tolist(), "people": people, "seconds": seconds}


def theirs(python: str, model: str, scenes: list[tuple[Scene, int]]) -> dict[tuple[Scene, int], Array]:
    """Returns the paths in one model of JuPedSim; of a plan that it refuses, none."""
    plans = [peer_input(drawn(*scene, 1)) for scene in scenes]
    with tempfile.TemporaryDirectory() as folder:
        given, paths = Path(folder) / "plans.json", Path(folder) / "paths.npz"
        given.write_text(json.dumps({"model": model, "dt": MODELS[model], "rate": SCRIPT_RATE, "plans": plans}))
        subprocess.run([python, RUNNER, given, paths], check=True)
        with np.load(paths) as found:
            return {scene: found[str(k)] for k, scene in enumerate(scenes) if str(k) in found}


def cell(test: Test, seeds: range, members: int, path: Callable[[Scene, int], Array | None]) -> str:
    """Returns what a simulator reaches in a test, and whether it passes."""
    rows = []
    for seed in seeds:
        paths = [path(scene, seed) for scene in test.scenes]
        known = [one for one in paths if one is not None]
        if len(known) < len(paths):
            return "refused ✗"
        rows.append(test.measure([drawn(scene, seed, members) for scene in test.scenes], known))
    values = np.mean(rows, axis=0)
    good = np.isfinite(values).all() and test.passed(values)
    return test.text.format(*values).replace("inf", "never").replace("nan", "–") + (" ✓" if good else " ✗")


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--peer-python", required=True, help="interpreter of an environment with jupedsim, shapely")
    parser.add_argument("--tests", nargs="*", default=[""], metavar="NUMBER", help="rows that begin so")
    add_seeds(parser, "20000:20003")
    args = parser.parse_args()
    tests, seeds = [test for test in TESTS if test.name.startswith(tuple(args.tests))], args.seeds
    wanted = dict.fromkeys((s, k) for test in tests if "peers" in test.columns for s in test.scenes for k in seeds)
    found = {model: theirs(args.peer_python, model, list(wanted)) for model in MODELS if wanted}
    head(["test", "asked", "flockscope", "flockscope, groups of 3", *(f"JuPedSim, {model}" for model in MODELS)])
    for test in tests:
        cells = [cell(test, seeds, n, lambda s, k, n=n: ours(s, k, n)) if word in test.columns else ""
                 for n, word in ((1, "alone"), (3, "threes"))]  # fmt: skip
        cells += [cell(test, seeds, 1, lambda s, k, m=m: found[m].get((s, k))) if "peers" in test.columns else "–"
                  for m in MODELS]  # fmt: skip
        row([test.name, test.asked, *cells])


if __name__ == "__main__":
    main()
