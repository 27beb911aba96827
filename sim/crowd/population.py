"""Who takes part: groups, sizes, bodies, speeds, starts and goals, drawn from the scenario, one stream per person.

A fixed start that is taken or lies in a wall is the scenario's error; a drawn one is drawn again for this group alone
(nobody else moves by it).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.scenario import GroupSpec, Scenario, group_names
from scenarios.schema.values import Distribution, Point, draw
from sim.crowd.formation import place, walking
from sim.rng import rng
from sim.types import Array, Scene

BODY_RADIUS = 0.20  # m, in the physics
ROOM = 0.55  # m between people of different groups at the start
TRIES = 400
STANDS = 0.3  # m: a group whose goal is nearer than this stands


@dataclass(frozen=True)
class Frame2:
    """The turn, the mirror and the lead (s) that a seed gives to a whole script."""

    middle: Array
    turn: float
    flip: float
    lead: float = 0.0

    def point(self, p: Array) -> Array:
        """A point of the script in the world."""
        d = (p - self.middle) * np.array([self.flip, 1.0])
        return self.middle + self.vector(d, flip=False)

    def vector(self, d: Array, *, flip: bool = True) -> Array:
        """A direction of the script in the world."""
        if flip:
            d = d * np.array([self.flip, 1.0])
        c, s = np.cos(self.turn), np.sin(self.turn)
        return np.array([c * d[0] - s * d[1], s * d[0] + c * d[1]])


@dataclass
class Member:
    """One person: column in the Motion, free speed, body."""

    column: int
    key: tuple[int, ...]
    free_speed: float
    height: float


@dataclass
class Party:
    """One group of the script as it enters."""

    name: str
    index: int
    members: list[Member]
    start: Array
    goal: Array
    via: list[Array]
    speed: float
    spacing: float
    enter: float
    finish: str
    pos: Array = field(default_factory=lambda: np.zeros((0, 2)))


def frame_of(scenario: Scenario, seed: int, repeat: int) -> Frame2:
    """The seed's turn and mirror of the script."""
    r = rng(seed, "layout", repeat=repeat)
    turn = np.deg2rad(draw(scenario.turn_deg, r))
    flip = -1.0 if scenario.mirror and r.random() < 0.5 else 1.0
    return Frame2(np.array(scenario.world.size) / 2, float(turn), flip, draw(scenario.lead, r))


def point_of(point: Point, frame: Frame2, r: np.random.Generator) -> Array:
    """A point of the script, drawn and put into the world."""
    return frame.point(np.array([draw(point[0], r), draw(point[1], r)]))


def _is_drawn(point: Point) -> bool:
    return any(isinstance(v, Distribution) for v in point)


def cast(scenario: Scenario, scene: Scene, seed: int, repeat: int) -> list[Party]:
    """All groups with their people, in the order of the script; members placed in formation at the start."""
    frame = frame_of(scenario, seed, repeat)
    taken: list[Array] = []
    parties: list[Party] = []
    column = 0
    for k, group in enumerate(scenario.group):
        for n, name in enumerate(group_names(group)):
            party = _party(scenario, group, name, (k, n), column, frame, seed, repeat)
            _find_room(scenario, party, group, (k, n), frame, scene, taken, seed, repeat)
            party.index = len(parties)
            column += len(party.members)
            parties.append(party)
            if party.enter == 0:
                taken.append(party.pos)
    return parties


def _party(
    scenario: Scenario,
    group: GroupSpec,
    name: str,
    key: tuple[int, int],
    column: int,
    frame: Frame2,
    seed: int,
    repeat: int,
) -> Party:
    r = rng(seed, "group", *key, 0, repeat=repeat)
    crowd = scenario.crowd
    size = max(1, round(draw(group.size, r)))
    spacing = draw(crowd.spacing, r)
    enter = max(0.0, draw(group.enter, r))
    own = draw(group.speed, r) if group.speed is not None else None
    goal = point_of(group.goal, frame, r)
    via = [point_of(p, frame, r) for p in group.via]
    members = []
    for m in range(size):
        p = rng(seed, "person", *key, m, repeat=repeat)
        members.append(Member(column + m, (*key, m), draw(crowd.free_speed, p), draw(crowd.height, p)))
    speed = own if own is not None else walking_speed([m.free_speed for m in members], crowd.slowdown_per_member)
    return Party(name, -1, members, np.zeros(2), goal, via, speed, spacing, enter, group.at_goal)


def walking_speed(free: list[float], slowdown: float) -> float:
    """A group walks at its members' mean minus `slowdown` (n - 1), but not below 0.3 m/s."""
    return max(0.3, float(np.mean(free)) - slowdown * (len(free) - 1))


def _find_room(
    scenario: Scenario,
    party: Party,
    group: GroupSpec,
    key: tuple[int, int],
    frame: Frame2,
    scene: Scene,
    taken: list[Array],
    seed: int,
    repeat: int,
) -> None:
    """Draw the start until the formation stands free of walls, pillars and those already placed."""
    r = rng(seed, "group", *key, 1, repeat=repeat)
    for _ in range(TRIES if _is_drawn(group.start) else 1):
        party.start = point_of(group.start, frame, r)
        first = party.via[0] if party.via else party.goal
        way = first - party.start
        length = float(np.linalg.norm(way))
        heading = way / length if length > 1e-6 else frame.vector(np.array([1.0, 0.0]))
        party.start = party.start + min(frame.lead * party.speed, length / 2) * heading * (length > STANDS)
        party.pos = place(walking(len(party.members), party.spacing), party.start, heading)
        if _is_free(party.pos, scene, taken if party.enter == 0 else []):
            return
    raise InputError(
        file=f"scenario {scenario.name}",
        place=f"group.{group.id}.start (seed {seed})",
        got="no free place" if _is_drawn(group.start) else "a place in a wall, a pillar or another group",
        expected=f"{len(party.members)} people {ROOM} m clear of others and {BODY_RADIUS} m of walls",
        remedy="move the start, widen its distribution, or have fewer people",
    )


def _is_free(pos: Array, scene: Scene, taken: list[Array]) -> bool:
    if taken:
        others = np.concatenate(taken)
        if np.min(np.sum((pos[:, None] - others[None]) ** 2, axis=2)) < ROOM**2:
            return False
    for wall in scene.walls:
        u = wall[1] - wall[0]
        s = np.clip((pos - wall[0]) @ u / (u @ u), 0, 1)
        if np.min(np.linalg.norm(pos - wall[0] - s[:, None] * u, axis=1)) < BODY_RADIUS:
            return False
    d = np.linalg.norm(pos[:, None] - scene.pillars[None, :, :2], axis=2) - scene.pillars[None, :, 2]
    return bool((d >= BODY_RADIUS).all())
