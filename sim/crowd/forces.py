"""The forces people walk by: their parameters, and the names of all columns and slots that the force kernels use.

Forces on a person, in the order in which they are computed:

- towards the goal, the person's place in the group's formation and the group's velocity: `forces_goal_kernels`;
- sideways with the strides: `_sway` there;
- away from other people, other groups, walls and pillars: `forces_avoidance_kernels`.

`forces_goal_kernels.accelerate` adds them up. A body weighs 1 kg, so a force is an acceleration in m/s². The sum of the
avoidance forces and the goal force is capped at MAX_ACCELERATION. If the whole scene is turned or moved, the
forces turn or move with it. The order of people changes them by rounding only.

Model: boids inside a group (Reynolds 1987). Separation: members repel each other; alignment: they take up the others'
velocity; cohesion: they keep their places in the formation, or in a flock, which has none, go to the middle of their
neighbours. Between strangers: a power law of the time to collision (Karamouzas, Skinner & Guy 2014). *Ours*: people
slow down for a stranger ahead who walks the same way, and evade others who come nearer. Groups also avoid each other as
wholes, so strangers walk round a group and seldom through it. A group waits at its gathering point until all members
are there. Groups of one procession follow each other on one way: each takes up the speed of the one ahead, corrects its
distance from it, as members their places, and waits for the one behind.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.types import Array, Bools, Ints

# columns of `state` (N, 4): position in m, velocity in m/s
X, Y, VX, VY = range(4)

# columns of PeopleArrays.tag (N, 4)
GROUP, MODE, QUEUE, PROCESSION = range(4)
# MODE of a person: walks with the group, to a place in a queue, or alone to the next point of the own way
IN_GROUP, TO_TARGET, ALONE = range(3)

# kinds of a waypoint: pass it, wait there for the whole group, end of the way
PASS, GATHER, END = range(3)
# what a group does at the end of its way
STAND, LEAVE = range(2)

# columns of PeopleArrays.noise (N, 4): fluctuation of the wanted velocity in its direction and to its left, m/s; of the
# place in the formation, forward and left, m
WANDER_ALONG, WANDER_LEFT, STRAY_AHEAD, STRAY_LEFT = range(4)
# columns of PeopleArrays.gait (N, 5): cosine and sine of the phase of the strides; velocity of the sway x, y, m/s;
# amplitude of the sway at 1.34 m/s, m
COS, SIN, SWAY_X, SWAY_Y, AMPLITUDE = range(5)

# columns of GroupArrays.status (G, 12): number of members present; mean of their positions, m; mean of their
# velocities, m/s; largest distance of a member from the mean position, m; largest distance of a member from its place
# in the formation, m; wanted velocity, m/s; 1.0 while other groups avoid this group as a whole, else 0.0; mean of the
# members' STRAY_AHEAD and STRAY_LEFT, m
(
    COUNT, MEAN_X, MEAN_Y, MEAN_VX, MEAN_VY, RADIUS, MAX_OFF_PLACE, WANTED_VX, WANTED_VY, AVOIDED, MEAN_AHEAD,
    MEAN_LEFT,
) = range(12)  # fmt: skip

# what a waypoint lies in if in no gate: nothing, as a point of the script or a goal, or beside the end of a wall
FREE, CORNER = -1, -2

# columns of GroupArrays.boids (G, 4): repulsion of two members at distance zero, m/s²; distance at which it ends, m;
# rate at which a member takes up the others' mean velocity, 1/s, and goes to its place or their middle, 1/s
REPULSION, REACH, ALIGN, COHERE = range(4)

# columns of `gate_state` (K, 3): side whose people may pass, 1.0 or -1.0, 0.0 for none, or BOTH, or SHUT, or CLOSING,
# which people may leave only; s since this was decided, -FIRST for the side that passes a door just opened until nobody
# of it is left; side that comes next
HOLDER, HELD, NEXT = range(3)
BOTH, SHUT, CLOSING = 2.0, 3.0, 4.0
FIRST = 1e6  # s: longer than any simulation

# columns of Obstacles.walls (W, 4) and .pillars (P, 3); the last one of .stairs (S, 10), after those of `terrain`
X1, Y1, X2, Y2 = range(4)
PILLAR_X, PILLAR_Y, PILLAR_RADIUS = range(3)
SLOWDOWN = 9

# parameters
RELAXATION = 0.5  # s: time in which a person takes up the wanted velocity
COHESION_TIME = 1.6  # s: time in which a member returns to its place in the formation
ALIGNMENT = 0.25  # 1/s: rate at which a member takes up the group's mean velocity
FLOCK_ALIGNMENT = 2.0  # 1/s: the same in a flock, of the neighbours' mean velocity
FLOCK_RANGE = 3.0  # m: members of a flock so near are neighbours
FLOCK_REACH = 1.4  # distances of neighbours at which their repulsion ends in a flock
SEPARATION = 2.5  # m/s²: repulsion between two members at distance zero
SEPARATION_RANGE = 0.6  # m: distance at which that repulsion ends
HASTE = 0.15  # share of the group's speed that a member may add to keep its place
TURN_TIME = 0.7  # s: time in which a group's heading follows its way
SLOW_TIME = 0.9  # s: how early a group slows down before a goal where it stands
AVOID_PERSON = 1.3  # strength of the power law between strangers
AVOID_GROUP = 1.6  # strength of the power law between whole groups
AVOID_TIME = 2.5  # s: time constant of the power law; collisions beyond four times this are ignored
PERSON_RADIUS = 0.29  # m: half the distance that strangers keep
PERSON_RANGE = 3.5  # m: strangers further apart ignore each other
GROUP_RANGE = 8.0  # m: groups further apart ignore each other
AVOID_MAX = 2.0  # m/s²: cap of each avoidance force
SHOVE = 3.0  # m/s²: repulsion between strangers at distance zero
SLOWING = 1.3  # 1/s²: a stranger ahead who walks the same way slows people by this times what is missing to ROOM_AHEAD
ROOM_AHEAD = 1.26  # m: distance from a stranger ahead from which on people slow down
EVADING = 1.2  # 1/s²: people evade any other stranger ahead by this times what is missing to PERSON_RANGE
USUAL_SPEED = 1.34  # m/s: speed to which the amplitude of a person's sway and the repulsion of walls refer
WALL = 4.0  # m/s²: repulsion of a wall or pillar at contact
WALL_RANGE = 0.25  # m: distance over which that repulsion falls to 37 %
GATHER_RADIUS = 0.9  # m: a group has gathered when all members are this close to their places
PASS_RADIUS = 0.8  # m: a waypoint counts as passed at this distance
MAX_ACCELERATION = 2.2  # m/s²: cap of the sum of all forces


class GroupArrays(NamedTuple):
    """State of G groups and of the ways they walk.

    The goal kernels update all from current to by_x but speed and finish.
    """

    route: Array  # (G, W, 2) x, y of each group's waypoints, m
    kind: Ints  # (G, W) PASS, GATHER or END of each waypoint
    length: Ints  # (G,) number of waypoints; later entries of route and kind mean nothing
    current: Ints  # (G,) index, from 0, of the waypoint the group is walking to
    speed: Array  # (G,) m/s
    heading: Array  # (G, 2) unit vector in which the group faces
    finish: Ints  # (G,) STAND or LEAVE at the end of the way
    filing: Bools  # (G,) True while the members walk each alone, as through a gate
    held_up: Array  # (G,) s for which others have held the group up just before its end
    # (G,) True once the end of the way is reached. status (G, 12), rewritten in each step: number of members present;
    # mean position x, y, m; mean velocity x, y, m/s; largest distance of a member from the mean position, and from its
    # place, m; wanted velocity x, y, m/s; 1.0 while other groups avoid this group as a whole, else 0.0; mean of the
    # members' fluctuations of place, m.
    arrived: Bools
    status: Array
    push: Array  # (G, 2) acceleration by which each group avoids other groups, m/s²
    by_x: Ints  # (G,) indices of the groups, sorted by the x of their members in the last step
    flock: Bools  # (G,) True for groups without formation
    boids: Array  # (G, 4) strengths of the forces between members
    head: Ints  # (G,) first of the groups that walk behind each other, whose indices follow on it; alone: itself
    gap: Array  # (G,) wanted distance from the group ahead of these, middle to middle, m

    @classmethod
    def empty(cls, g: int, w: int) -> GroupArrays:
        """Returns arrays for g groups with room for w waypoints each: headings (1, 0), all other values 0."""
        return cls(
            np.zeros((g, w, 2)), np.zeros((g, w), np.int64), np.zeros(g, np.int64), np.zeros(g, np.int64), np.zeros(g),
            np.tile([1.0, 0.0], (g, 1)), np.zeros(g, np.int64), np.zeros(g, np.bool_), np.zeros(g),
            np.zeros(g, np.bool_), np.zeros((g, 12)), np.zeros((g, 2)), np.arange(g), np.zeros(g, np.bool_),
            np.tile([SEPARATION, SEPARATION_RANGE, ALIGNMENT, 1.0 / COHESION_TIME], (g, 1)), np.arange(g), np.zeros(g),
        )  # fmt: skip

    def with_room(self, w: int) -> GroupArrays:
        """Returns arrays with room for at least w waypoints of each group: these, or longer route and kind."""
        if w <= self.kind.shape[1]:
            return self
        room = ((0, 0), (0, w - self.kind.shape[1]))
        return self._replace(route=np.pad(self.route, (*room, (0, 0))), kind=np.pad(self.kind, room))


class PeopleArrays(NamedTuple):
    """What the kernels know of the N people present, in the order of the physics engine's rows."""

    place: Array  # (N, 2) place in the formation, m: forward and left of the group's middle
    target: Array  # (N, 2) x, y, m, of the place in a queue, or of the point to which a person walks alone
    pace: Array  # (N,) greatest speed on the way there, m/s
    # (N, 4) fluctuation of the wanted velocity in its direction and to its left, m/s, and of the place in the
    # formation, forward and left, m
    noise: Array
    # (N, 5) cosine and sine of the phase of the strides; velocity of the sway x, y, m/s; amplitude of the sway at 1.34
    # m/s, m. `_sway` updates all but the amplitude.
    gait: Array
    calm: Array  # (N, 4) x, y, vx, vy without the velocity of the sway, m, m/s
    wanted: Array  # (N, 2) wanted velocity without its fluctuation, m/s. The goal kernels overwrite both.
    # (N, 4) columns GROUP (index), MODE (IN_GROUP, TO_TARGET or ALONE), QUEUE (index, -1 in no queue), PROCESSION
    # (index of the head)
    tag: Ints

    @classmethod
    def empty(cls, n: int) -> PeopleArrays:
        """Returns arrays for n people: paces 1, tags -1, all other values 0."""
        two, four = ([np.zeros((n, k)) for _ in range(3)] for k in (2, 4))
        tag = np.full((n, 4), -1, np.int64)
        return cls(two[0], two[1], np.ones(n), four[0], np.zeros((n, 5)), four[1], two[2], tag)


class Obstacles(NamedTuple):
    """What stands still in the scene, m. What the scene has not is None, so that its forces are not compiled."""

    # (S, 10) rows of `sim.scene.terrain.flight_rows`, and the share of the speed kept on them (0 to 1); None without
    stairs: Array | None
    walls: Array | None  # (W, 4) x1, y1, x2, y2 of the two ends; None without walls and pillars
    pillars: Array  # (P, 3) x, y of the middle, radius

    @classmethod
    def of(cls, stairs: Array, walls: Array, pillars: Array) -> Obstacles:
        """Returns the obstacles of a scene; each of the arrays may be empty."""
        return cls(stairs if len(stairs) else None, walls if len(walls) + len(pillars) else None, pillars)
