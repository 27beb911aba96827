"""The forces people walk by: parameters, and the arrays the kernel reads and writes.

Boids for the members of a group (separation, alignment, cohesion towards a place in the formation), goal seeking and
anticipatory avoidance for all (Karamouzas, Skinner & Guy 2014: a power law of the time to collision), walls. All are
accelerations (bodies weigh 1), pure functions of the arrays below, equivariant under turning the scene, independent of
the order of people up to rounding, and capped together at `max_acceleration`.

*Ours*: groups avoid each other as wholes besides their members avoiding each other, which is why strangers go round a
group and seldom through it; a group waits at its gathering point until all are there.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np

from sim.types import Array, Bools, Ints

# modes of a person
IN_GROUP, TO_TARGET = 0, 1
# kinds of a waypoint: pass it, pass it one by one (a door), wait there for all of the group, the end of the way
PASS, NARROW, GATHER, END = 0, 1, 2, 3
# what a group does at the end of its way
STAND, LEAVE = 0, 1


@dataclass(frozen=True, slots=True)
class Steering:
    """Parameters of the forces; the order of the fields is the kernel's."""

    relaxation: float = 0.5  # s: time to take up the wanted velocity
    cohesion_time: float = 1.6  # s: time in which a member wants to be back in its place
    alignment: float = 0.25  # 1/s towards the group's mean velocity
    separation: float = 2.5  # m/s^2 at zero distance between members
    separation_range: float = 0.6  # m
    haste: float = 0.15  # share of the speed that members may add to keep their place
    turn_time: float = 0.7  # s: time in which a group's heading follows its way
    slow_time: float = 0.9  # s: how early a group slows down before a standing goal
    avoid_person: float = 1.3  # strength of the power law between strangers
    avoid_group: float = 1.6  # the same between groups as wholes
    avoid_time: float = 2.5  # s: time to collision beyond which nobody cares
    person_radius: float = 0.29  # m: half the distance strangers want to keep
    person_range: float = 3.5  # m
    group_range: float = 8.0  # m
    avoid_max: float = 2.0  # m/s^2, cap of each avoidance
    shove: float = 3.0  # m/s^2 between strangers closer than they want to be
    wall: float = 4.0  # m/s^2 at contact with a wall or pillar
    wall_range: float = 0.25  # m, decay
    gather_radius: float = 0.9  # m: everybody this close to his place = the group has gathered
    pass_radius: float = 0.8  # m
    max_acceleration: float = 2.2  # m/s^2

    def array(self) -> Array:
        """All parameters as the kernel wants them."""
        return np.array(astuple(self))


class Groups(NamedTuple):
    """Arrays over G groups; state of the way and what the kernel writes.

    route (G, W, 2) and kind (G, W): waypoints, `length` (G,) of them, `at` (G,) the current one; speed (G,) m/s;
    heading (G, 2); finish (G,) STAND or LEAVE; arrived (G,); now (G, 10): count, middle x y, mean velocity x y, disc
    radius, largest way from a place, wanted velocity x y, disc weight: scratch written at each step.
    """

    route: Array
    kind: Ints
    length: Ints
    at: Ints
    speed: Array
    heading: Array
    finish: Ints
    arrived: Bools
    now: Array

    @classmethod
    def empty(cls, g: int, w: int) -> Groups:
        """Room for g groups with ways of up to w points."""
        return cls(
            np.zeros((g, w, 2)),
            np.zeros((g, w), np.int64),
            np.zeros(g, np.int64),
            np.zeros(g, np.int64),
            np.zeros(g),
            np.tile([1.0, 0.0], (g, 1)),
            np.zeros(g, np.int64),
            np.zeros(g, np.bool_),
            np.zeros((g, 10)),
        )


class People(NamedTuple):
    """Arrays over the N people present, in the order of the physics engine's rows.

    place (N, 2): (forward, left) in the formation; target (N, 2): of people in mode TO_TARGET; pace (N,): own speed
    for targets; wander (N, 2): fluctuation of the wanted velocity, m/s; tag (N, 4): group, mode, queue (-1 none),
    waypoint.
    """

    place: Array
    target: Array
    pace: Array
    wander: Array
    tag: Ints

    @classmethod
    def empty(cls, n: int) -> People:
        """Room for n people."""
        return cls(np.zeros((n, 2)), np.zeros((n, 2)), np.ones(n), np.zeros((n, 2)), np.full((n, 4), -1, np.int64))


class Obstacles(NamedTuple):
    """walls (W, 4) x1 y1 x2 y2; pillars (P, 3) x y r; stairs (S, 8): foot, axis, length, width, slowdown, landing."""

    walls: Array
    pillars: Array
    stairs: Array
