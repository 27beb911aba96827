"""Draws who takes part: groups with sizes, starts, stops and goals, and each person's height, speed and gait.

Every person draws from streams of their own, so one person more changes nobody else. A start from a distribution is
drawn again, for this group alone, until the group has room there.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from scenarios.errors import InputError, counted
from scenarios.schema.colours import rgb
from scenarios.schema.groups import GroupSpec, Stop, SubGroupSpec, group_names, part_names, parts_of
from scenarios.schema.scenario import CrowdSpec, Scenario
from scenarios.schema.values import Distribution, Point, Value
from sim.crowd.formation import procession, to_world
from sim.elementary import exp, length, unit
from sim.geometry.walls import wall_distances
from sim.rng import autoregression, draw, normals, rng, uniforms
from sim.types import Array, Order, Scene


@dataclass(frozen=True)
class PlannedStop:
    """One stop of one group, with all random values drawn."""

    at: Array  # (2,) place in the world, m
    stay: float  # s
    until: tuple[float, ...]  # times, s after the first recorded frame, ascending; may be empty
    members: tuple[int, ...]  # numbers of the members who stop, from 0, ascending; at least one
    whole: bool  # True if all members stop

    def end(self, t: float) -> float:
        """Returns the time (s) at which people who arrive at time t (s) walk on; inf if never."""
        return next((u for u in self.until if u >= t), np.inf) + self.stay if self.until else t + self.stay


def draw_stops(
    stops: tuple[Stop, ...], size: int, place: Callable[[Point], Array], r: np.random.Generator
) -> list[PlannedStop]:
    """Returns the drawn stops of a group of `size` people; a stop without members or without time is left out.

    place: a function that draws a point of the script and returns where it lies in the world.
    """
    planned = []
    for stop in stops:
        at, stay = place(stop.at), max(0.0, draw(stop.stay, r))
        wanted = size if stop.members is None else min(round(draw(stop.members, r)), size)
        if wanted > 0 and (stay > 0 or stop.until):
            who = range(size) if wanted == size else sorted(r.permutation(size)[:wanted].tolist())
            planned.append(PlannedStop(at, stay, tuple(sorted(stop.until)), tuple(who), wanted == size))
    return planned


BODY_RADIUS = 0.20  # m, in the physics
START_GAP = 0.55  # m between people of different groups at the start
TRIES = 400  # draws of a start
STANDING_DISTANCE = 0.3  # m: a group whose goal is no further than this stands
MIN_SPEED = 0.3  # m/s, of a group
WANDER_TIME = 1.0  # s, correlation time of the fluctuation of the wanted velocity
PLACE_TIME = 10.0  # s, correlation time of the fluctuation of the place in the formation
PORTION = 16384  # random numbers made normal together: they fit into the processor's cache


@dataclass(frozen=True)
class ScriptPlacement:
    """How the script is mirrored, turned and advanced in the world; drawn with the seed."""

    middle: Array  # (2,) middle of the world, m, about which the script is turned
    turn: float  # angle in radians, counter-clockwise
    flip: float  # -1.0 mirrors x before the turn, 1.0 does not
    lead: float = 0.0  # s by which all walking groups start further along their way; negative: further back

    def point(self, p: Array) -> Array:
        """Returns where a point (2,) of the script lies in the world: mirrored if flip is -1, then turned."""
        return self.middle + self.vector(p - self.middle)

    def vector(self, d: Array) -> Array:
        """Returns a direction (2,) of the script in the world: mirrored if flip is -1, then turned."""
        (x, y), (c, s) = d.tolist(), self._turned
        return np.array([c * (x * self.flip) - s * y, s * (x * self.flip) + c * y])

    @cached_property
    def _turned(self) -> list[float]:
        return list(unit(self.turn).tolist())


@dataclass
class Person:
    """One person of a crowd."""

    column: int  # in the arrays of a Motion, from 0; the person's id is column + 1
    # (entry of the scenario's `group` list, its copy, sub-group if it has some, member), each from 0; keys the person's
    # random streams
    key: tuple[int, ...]
    free_speed: float  # walking speed alone, m/s
    height: float  # of the body, m
    sway: float  # amplitude of the sideways movement with each stride at 1.34 m/s, m
    phase: float  # of the strides at first, rad
    # (2, 3) red, green, blue of upper garment and trousers, grey levels; nan where any
    clothes: Array = field(default_factory=lambda: np.full((2, 3), np.nan))


@dataclass
class EnteringGroup:
    """One group of the script, or one of its sub-groups, as it enters the scene."""

    name: str  # of the group in the script
    index: int  # among all groups and sub-groups, from 0
    members: list[Person]  # its people, in order
    # the middle of the script's group as it enters; goal (2,), via (each (2,)): points in the world, m
    start: Array
    goal: Array
    via: list[Array]
    speed: float  # of the group, m/s
    spacing: float  # between neighbours, m
    flock: bool  # True without formation
    # time of entry, s after the first recorded frame (0: there from the start of the warm-up; negative: in the warm-up)
    enter: float
    finish: str  # at the goal "stand", "leave" the scene or "walk" on
    stops: list[PlannedStop] = field(default_factory=list)  # before `via`
    pos: Array = field(default_factory=lambda: np.zeros((0, 2)))  # (n, 2) where the members start, m
    part: str = ""  # whole name of a sub-group, such as class.pair-1
    head: int = -1  # index of the first sub-group of the script's group; without sub-groups its own
    gap: float = 0.0  # wanted distance of a sub-group's middle from that of the one ahead, m

    @property
    def walks(self) -> bool:
        """True if the group's first stop, or its goal if it has no stops, is more than 0.3 m from its start."""
        return bool(length(self.leg(self.stops)[1] - self.start) > STANDING_DISTANCE)

    def leg(self, stops: Sequence[PlannedStop]) -> tuple[list[Array], Array, str]:
        """Returns the points to pass, the end point and the finish of the group's next way.

        It leads to the first of `stops`, where finish is "stand"; without stops past `via` to the goal.
        """
        return ([], stops[0].at, "stand") if stops else (self.via, self.goal, self.finish)


def script_placement(scenario: Scenario, seed: int, repeat: int) -> ScriptPlacement:
    """Returns the turn, mirror and lead that a seed draws for the script of a scenario."""
    r = rng(seed, "layout", repeat=repeat)
    turn = draw(scenario.turn_deg, r) / 180 * np.pi
    flip = -1.0 if scenario.mirror and r.random() < 0.5 else 1.0
    return ScriptPlacement(np.array(scenario.world.size) / 2, float(turn), flip, draw(scenario.lead, r))


def draw_point(point: Point, placement: ScriptPlacement, r: np.random.Generator) -> Array:
    """Returns a point of the script in the world (2,): drawn, then mirrored and turned."""
    return placement.point(np.array([draw(point[0], r), draw(point[1], r)]))


@dataclass(frozen=True)
class _Draws:
    """What every draw of a population needs: scenario, its scene, the script's placement (turn, mirror and lead), and
    the random keys seed and repeat (number of the suite entry's copy, 0 for none)."""

    scenario: Scenario
    scene: Scene
    placement: ScriptPlacement
    seed: int
    repeat: int

    def rng(self, role: str, *keys: int) -> np.random.Generator:
        return rng(self.seed, role, *keys, repeat=self.repeat)


def draw_population(scenario: Scenario, scene: Scene, seed: int, repeat: int) -> list[EnteringGroup]:
    """Returns all groups of the script with their members, in the order of the file.

    Raises InputError if a group has no free place at its start.
    """
    draws = _Draws(scenario, scene, script_placement(scenario, seed, repeat), seed, repeat)
    taken = TakenPlaces()
    groups: list[EnteringGroup] = []
    column = 0
    for k, spec in enumerate(scenario.group):
        for n, name in enumerate(group_names(spec)):
            parts = _draw_group(draws, spec, name, (k, n), column, len(groups))
            _find_room(draws, parts, spec, (k, n), taken)
            groups += parts
            for part in parts:
                column += len(part.members)
                if part.enter == 0:
                    taken.add(part.pos)
    return groups


def _draw_group(
    draws: _Draws, spec: GroupSpec, name: str, key: tuple[int, int], column: int, index: int
) -> list[EnteringGroup]:
    """Draws a group and its members, without its start and `pos`: its sub-groups, or the group alone.

    key: of its entry and copy. column, index: of its first person, and of its first sub-group.
    """
    r = draws.rng("group", *key, 0)
    crowd, parts = draws.scenario.crowd, parts_of(spec)
    # Each sub-group has streams of its own, so that one more changes no other.
    streams = [draws.rng("group", *key, 3, j) for j in range(len(parts))] if spec.groups else [r]
    sizes = [max(1, round(draw(part.size, own))) for part, own in zip(parts, streams, strict=True)]
    spacing = draw(crowd.spacing, r)
    enter = max(-draws.scenario.warmup, draw(spec.enter, r))
    own = draw(spec.speed, r) if spec.speed is not None else None
    goal = draw_point(spec.goal, draws.placement, r)
    via = [draw_point(p, draws.placement, r) for p in spec.via]
    members: list[list[Person]] = []
    for j, (part, size) in enumerate(zip(parts, sizes, strict=True)):
        keys = [(*key, j, m) if spec.groups else (*key, m) for m in range(size)]
        members.append([_draw_person(draws, spec, part, own_key, column + m) for m, own_key in enumerate(keys)])
        column += size
    slowest = min(walking_speed([m.free_speed for m in some], crowd.slowdown_per_member) for some in members)
    q = draws.rng("group", *key, 2)
    stops = draw_stops(spec.stops, sum(sizes), lambda point: draw_point(point, draws.placement, q), q)
    names = [f"{name}.{part}" for part in part_names(spec)] or [""]
    return [
        EnteringGroup(
            name, index + j, members[j], np.zeros(2), goal, via, slowest if own is None else own, spacing,
            part.formation == "none", enter, spec.at_goal, stops, part=names[j], head=index,
        )
        for j, part in enumerate(parts)
    ]  # fmt: skip


def _draw_person(
    draws: _Draws, spec: GroupSpec, part: GroupSpec | SubGroupSpec, key: tuple[int, ...], column: int
) -> Person:
    """Draws a member of a group, or of one of its sub-groups; what a sub-group does not say is as in the group."""
    p, crowd = draws.rng("person", *key), draws.scenario.crowd
    height = next((h for h in (part.height, spec.height) if h is not None), crowd.height)
    own_draws = (draw(crowd.free_speed, p), draw(height, p), draw(crowd.sway, p), 2 * np.pi * p.random())
    clothes = np.array(
        [_colour(colours, p) for colours in (part.clothes or spec.clothes, part.trousers or spec.trousers)]
    )
    return Person(column, key, *own_draws, clothes)


def _colour(colours: tuple[str, ...] | None, r: np.random.Generator) -> tuple[float, ...]:
    return (np.nan,) * 3 if colours is None else rgb(colours[int(r.integers(len(colours)))])


def walking_speed(free: list[float], slowdown: float) -> float:
    """Returns a group's speed in m/s: the mean free speed less `slowdown` times (members - 1), at least 0.3."""
    return max(MIN_SPEED, float(np.mean(free)) - slowdown * (len(free) - 1))


def _find_room(
    draws: _Draws, parts: list[EnteringGroup], spec: GroupSpec, key: tuple[int, int], taken: TakenPlaces
) -> None:
    """Sets start, pos and gap of a group's parts so that the members stand clear; InputError if no try finds room."""
    placement = draws.placement
    drawn = spec.scatter != 0.0 or any(isinstance(v, Distribution) for v in spec.start)
    r = draws.rng("group", *key, 1)
    group, sizes = parts[0], [len(part.members) for part in parts]
    places, gaps = procession(sizes, group.spacing)
    for _ in range(TRIES if drawn else 1):
        group.start = draw_point(spec.start, placement, r)
        via, end, _ = group.leg(group.stops)
        first = via[0] if via else end
        way = first - group.start
        far = float(length(way))
        heading = way / far if far > 1e-6 else placement.vector(np.array([1.0, 0.0]))
        # At most half-way to the first goal.
        lead = min(placement.lead * group.speed, far / 2)
        group.start = group.start + lead * heading * (far > STANDING_DISTANCE)
        pos = to_world(np.concatenate(places), group.start, heading)
        if spec.scatter != 0.0:
            pos += scattered(len(pos), spec.scatter, r)
        together = spec.scatter == 0.0 or _apart(pos)
        if together and is_free(pos, draws.scene, taken if group.enter == 0 else TakenPlaces()):
            for part, gap, own in zip(parts, gaps, np.split(pos, np.cumsum(sizes)[:-1]), strict=True):
                part.start, part.gap, part.pos = group.start, gap, own
            return
    people = counted(sum(sizes), "person", "people")
    raise InputError(
        file=f"scenario {draws.scenario.name}", place=f"group.{spec.id}.start (seed {draws.seed})",
        got="no free place" if drawn else "a place in a wall, a pillar or another group",
        expected=f"{people} {START_GAP} m clear of others and {BODY_RADIUS} m of walls",
        remedy="move the start, widen its distribution, or have fewer people",
    )  # fmt: skip


def scattered(n: int, scatter: Value, r: np.random.Generator) -> Array:
    """Returns the displacements (n, 2) m of n people from their places at the start; scatter: their length in m."""
    far = np.array([draw(scatter, r) for _ in range(n)])
    return np.asarray(far[:, None] * unit(2 * np.pi * r.random(n)))


def _apart(pos: Array) -> bool:
    # Nobody is too near to themselves.
    gap = length(pos[:, None] - pos[None]) + 10 * np.eye(len(pos))
    return bool((gap >= 2 * BODY_RADIUS).all())


class TakenPlaces:
    """Places where nobody else may stand. State: cells: the places in each square of 1 m, by its number along x, y."""

    def __init__(self) -> None:
        self.cells: defaultdict[tuple[int, int], list[list[float]]] = defaultdict(list)

    def add(self, pos: Array) -> None:
        """Adds the places pos (n, 2) m."""
        for place in pos.tolist():
            self.cells[math.floor(place[0]), math.floor(place[1])].append(place)

    def near(self, pos: Array) -> Array:
        """Returns the places (K, 2) m in the cells of the points pos (n, 2) m and round them: all within 1 m."""
        near = {(i + a, j + b) for i, j in np.floor(pos).astype(int).tolist() for a in (-1, 0, 1) for b in (-1, 0, 1)}
        return np.array([place for cell in near & self.cells.keys() for place in self.cells[cell]]).reshape(-1, 2)


def is_free(pos: Array, scene: Scene, taken: TakenPlaces) -> bool:
    """Returns True if all points pos (n, 2) m are far enough from taken places, walls and pillars.

    That is START_GAP (0.55 m) from each place in `taken`, and BODY_RADIUS (0.2 m) from walls and pillars.
    """
    if length(pos[:, None] - taken.near(pos)[None]).min(initial=np.inf) < START_GAP:
        return False
    if wall_distances(pos[:, None], scene.walls).min(initial=np.inf) < BODY_RADIUS:
        return False
    d = length(pos[:, None] - scene.pillars[None, :, :2]) - scene.pillars[None, :, 2]
    return bool((d >= BODY_RADIUS).all())


def fluctuations(crowd: CrowdSpec, people: Sequence[Person], frames: int, fps: float, seed: int, repeat: int) -> Array:
    """Returns how wanted velocities and places fluctuate, (frames, P, 4): columns of `PeopleArrays.noise`.

    An Ornstein-Uhlenbeck process per column, stationary from the first frame: u_k = a u_(k-1) + sqrt(1 - a²) s n_k,
    with a = exp(-1 / (fps T)), T = 1 s for velocities and 10 s for places, standard normal n_k and u_0 = s n_0. The
    standard deviations s are those of `crowd`.
    """
    keep = exp(-1 / (fps * np.array([WANDER_TIME, WANDER_TIME, PLACE_TIME, PLACE_TIME])))
    out = np.empty((frames, len(people), 4))
    for p, person in enumerate(people):
        out[:, p] = uniforms(rng(seed, "gait", *person.key, repeat=repeat), (frames, 4))
    numbers = out.reshape(-1)
    for first in range(0, len(numbers), PORTION):
        numbers[first : first + PORTION] = normals(numbers[first : first + PORTION])
    scale = np.array([*crowd.velocity_noise, *crowd.place_noise])
    return scale * autoregression(out, keep)


def named_people(
    scenario: Scenario, scene: Scene, seed: int, repeat: int, orders: Iterable[Order]
) -> dict[str, tuple[int, ...]]:
    """Returns the person ids of each group and sub-group of the script, by its name (a sub-group's: class.pair-1).

    orders: the orders as carried out; groups that merge and split orders made are included.
    """
    parties = draw_population(scenario, scene, seed, repeat)
    names: dict[str, tuple[int, ...]] = {}
    for party in parties:
        ids = tuple(m.column + 1 for m in party.members)
        names[party.name] = names.get(party.name, ()) + ids
        names |= {party.part: ids} if party.part else {}
    after = {order.id: order.after for order in orders if order.fired is not None}
    for event in scenario.event:
        made = after.get(event.id)
        if made is None:
            continue
        if event.type == "merge":
            names[event.into] = made[0]
        elif event.type == "split":
            names |= {part.id: ids for part, ids in zip(event.parts, made, strict=True)}
    return names
