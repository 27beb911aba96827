"""The physics: turns a scenario and a seed into a Motion. The only module that imports pymunk.

People are discs of radius 0.2 m and mass 1 kg, so a force is an acceleration. The space resolves contacts. States are
read and forces written in batches; `World.columns` says which row of a batch is which person. Only forces move a person
who has entered.

Three clocks run side by side. The physics makes PHYSICS_RATE steps per s. SCRIPT_RATE times per s people come and go,
orders and stops are looked at, and the fluctuations of the walk change; from the states at these ticks the truth is
measured. The camera takes its frames at any rate: a frame is the state at its time, on the straight line between two
steps, which is how the physics moves people. So another frame rate shows the same world.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pymunk
import pymunk.batch

from scenarios.errors import WorkError
from scenarios.schema.scenario import Scenario
from sim.clock import PHYSICS_RATE, SCRIPT_RATE, STEPS, FrameTimes
from sim.crowd.arrival import NEAR_GOAL, STAND_TIME, has_way, immobile_people, obstacle, stands
from sim.crowd.forces import AMPLITUDE, COS, GATHER, SIN, Obstacles, PeopleArrays
from sim.crowd.group_state import GroupState
from sim.crowd.heading import facings, headings
from sim.crowd.navigation import Navigator, scene_of
from sim.crowd.order_execution import OrderExecution, groups_made
from sim.crowd.population import BODY_RADIUS, EnteringGroup, draw_population, fluctuations, script_placement
from sim.crowd.stops import Stops
from sim.crowd.timed_doors import TimedDoors
from sim.crowd.wayfinding import Wayfinding
from sim.draws import drawn
from sim.elementary import cos, length, sin
from sim.geometry.walls import blocked
from sim.scene.body import DEPTH_SHARE, SHOULDER_SHARE
from sim.scene.terrain import flight_rows
from sim.stuck import NeverArrives
from sim.types import Array, Bools, Ints, Motion, Scene, States

STEP_TIME = 1 / PHYSICS_RATE  # s
OVERLAP_LEFT = 0.0012600931512018426  # 0.875^50: share of an overlap of bodies that is left after 1 s, 0.875 a step.
# The C library's pow gives 0.875 exactly on every machine, because the true value lies 1e-18 from it.
ENTRY_GAP = 2.2  # body radii between a person who enters and all others
READ = pymunk.batch.BodyFields.POSITION | pymunk.batch.BodyFields.VELOCITY
WRITE = pymunk.batch.BodyFields.FORCE


def run(scenario: Scenario, seed: int, repeat: int = 0) -> Motion:
    """Returns the whole motion of a scenario for a seed, without the warm-up."""
    return World(drawn(scenario, seed, repeat), seed, repeat).run()


class World:
    """The running simulation of one scenario and seed; it can be run once. Column = person id - 1.

    State: `space`, `bodies` (by column): of the physics. state (N, 4): x, y, vx, vy, and `people`: of the N people
    present, whose columns are `columns`. force: of the N people, then zeros
    for static bodies. states (P, 4), group_of (P,): at the present tick, by column, nan and -1 while absent. between
    (STEPS + 1, P, 4): states from the present tick to the next, step by step, before people come and go there; None if
    all frames lie on ticks.
    """

    def __init__(self, scenario: Scenario, seed: int, repeat: int) -> None:
        self.scenario, self.seed, self.repeat = scenario, seed, repeat
        self.scene: Scene = scene_of(scenario.world)
        self.entering: list[EnteringGroup] = draw_population(scenario, self.scene, seed, repeat)
        self.waiting = list(self.entering)
        self.members = [m for group in self.entering for m in group.members]
        self.groups = GroupState(self.entering, groups_made(scenario), Navigator(self.scene), scenario.crowd)
        self.orders = OrderExecution(scenario, self.groups, script_placement(scenario, seed, repeat), seed, repeat)
        self.stops = Stops(self.entering, self.groups, self.scene)
        self.wayfinding = Wayfinding(self.groups)
        self.doors = TimedDoors(scenario.world, self.scene, self.wayfinding.gate_state)
        self.shut: dict[int, pymunk.Segment] = {}
        self.walls = [(0, self.scene.walls)]
        stairs = np.column_stack([flight_rows(self.scene), [spec.slowdown for spec in scenario.world.stairs]])
        self.obstacles = Obstacles.of(stairs, np.array(self.scene.walls).reshape(-1, 4), np.array(self.scene.pillars))
        self.space = _space(self.scene)
        self.bodies: dict[int, pymunk.Body] = {}
        self.columns = np.zeros(0, np.int64)
        phase = np.array([m.phase for m in self.members])
        strides = np.stack([cos(phase), sin(phase), [m.sway for m in self.members]], axis=1)
        self.groups.everybody.gait[:, [COS, SIN, AMPLITUDE]] = strides
        self.states = np.full((len(self.members), 4), np.nan)
        self.group_of = np.full(len(self.members), -1, np.int64)
        on_ticks = scenario.camera.fps == SCRIPT_RATE
        self.between = None if on_ticks else np.full((STEPS + 1, len(self.members), 4), np.nan)
        self.people = PeopleArrays.empty(0)
        self.state = np.zeros((0, 4))
        self.force = np.zeros((0, 2))
        if self.doors.times:
            self._move_doors(0)
        self._read_buffer, self._write_buffer = pymunk.batch.Buffer(), pymunk.batch.Buffer()

    def run(self) -> Motion:
        """Runs the simulation and returns its Motion without the warm-up.

        Raises WorkError if a position or velocity is not finite.
        """
        fps, duration = self.scenario.camera.fps, self.scenario.duration
        count = max(1, math.ceil(duration * SCRIPT_RATE - 1e-9))
        frames = FrameTimes.of(max(1, round(duration * fps)), fps)
        people, needed = len(self.members), count if self.between is None else max(count, int(frames.tick[-1]) + 2)
        states, intents = np.empty((needed, people, 4)), np.empty((needed, people), np.int64)
        free = np.ones((needed, people), np.bool_)
        subgroups = np.full_like(intents, -1) if any(g.part for g in self.entering) else None
        waiting = np.zeros_like(free) if self.doors.times else None
        shown = states[: len(frames.tick)] if self.between is None else np.empty((len(frames.tick), people, 4))
        for tick, (state, group) in enumerate(self.ticks(needed)):
            states[tick], intents[tick] = state, group
            if subgroups is not None:
                subgroups[tick] = self.groups.subgroups()
            if waiting is not None:
                waiting[tick] = self.wayfinding.waiting()
            if not tick % SCRIPT_RATE:  # `immobile_people` looks once a second
                free[tick] = self._free_to_walk()
            if tick and self.between is not None:  # what lies between two ticks is known at the second one
                shown[frames.within(tick - 1)] = frames.states(tick - 1, self.between)
        lost = tuple(self._never_arrive(states[:count]))
        motion = self._motion(
            states[:count], intents[:count], shown, intents[frames.tick], frames,
            None if waiting is None else waiting[:count],
        )  # fmt: skip
        return motion.replace(
            never_arrive=lost, immobile=immobile_people(states[:count, :, :2], free[:count], SCRIPT_RATE),
            subgroup=None if subgroups is None else subgroups[frames.tick],
        )  # fmt: skip

    def _free_to_walk(self) -> Bools:
        """Returns flags (P,): False for people whom a queue, a stop, a gathering or the end of their way bids wait."""
        groups, arrays = self.groups, self.groups.arrays
        waits = arrays.arrived | (arrays.kind[np.arange(len(arrays.kind)), arrays.current] == GATHER)
        waits[self.stops.standing()] = True
        at_door = self.wayfinding.waiting()
        return np.asarray(~(waits[groups.group_of] | (groups.queue_of >= 0) | groups.held | at_door))

    def _never_arrive(self, states: Array) -> Iterator[NeverArrives]:
        """Yields the groups that do not reach their goal. states (C, P, 4): at the ticks, by column."""
        since = (len(states) - 1) / SCRIPT_RATE - STAND_TIME
        walking = ((name, head, g) for name, head in self.groups.alive.items() for g in self.groups.processions[head])
        for name, head, g in walking:
            columns = [c for c in self.groups.members[g] if np.isfinite(states[-1, c, 0])]
            if not columns or (self.groups.queue_of[columns] >= 0).any() or self.stops.stood(head, columns, since):
                continue
            place, (goal, _) = states[-1, columns, :2], self.groups.goals[g]
            targets = [goal] if self.groups.arrays.arrived[g] else [*self.groups.ahead(g), goal]
            closed = next((target for target in targets if not has_way(self.scene, place, target)), None)
            middle, target = place.mean(axis=0), goal if closed is None else closed
            if closed is None and not self._stands_short(g, columns, states, middle, goal):
                continue
            pos, end = ((round(float(x), 2), round(float(y), 2)) for x, y in (middle, target))
            words = obstacle(self.scene, middle, target)
            yield NeverArrives(name, tuple(c + 1 for c in columns), pos, end, closed is not None, words)

    def _stands_short(self, g: int, columns: list[int], states: Array, middle: Array, goal: Array) -> bool:
        waits = self.groups.arrays.arrived[g] or self.groups.gathers(g) or float(length(middle - goal)) < NEAR_GOAL
        waits |= bool(self.wayfinding.waiting()[columns].any())
        return not waits and stands(states[:, columns], SCRIPT_RATE)

    def ticks(self, length: int) -> Iterator[tuple[Array, Ints]]:
        """Yields the states (P, 4) and group indices (P,) at each of the `length` ticks after the warm-up.

        Rows are columns of the Motion; absent people have nan and -1. Each tick overwrites both arrays.
        """
        warm = round(self.scenario.warmup * SCRIPT_RATE)
        noise = fluctuations(self.scenario.crowd, self.members, warm + length, SCRIPT_RATE, self.seed, self.repeat)
        for tick in range(-warm, length):
            if tick > -warm:
                self._advance(noise[tick + warm])
            t = tick / SCRIPT_RATE
            self._come_and_go(t, tick == -warm)
            self.states[self.columns] = self.state
            changed = self.stops.advance(t, self.states)
            if tick >= 0:
                self.group_of[self.columns] = self.groups.intent(self.columns)
                changed |= self.orders.advance(tick, t, self.states)
            if self.doors.advance(t, self.states[:, :2]):
                self._move_doors(max(tick, 0))
            changed |= self.wayfinding.advance(t, self.states)
            if changed:
                self.people = self.groups.rows(self.columns)
            if tick >= 0:
                yield self.states, self.group_of

    def _advance(self, noise: Array) -> None:
        n = len(self.columns)
        if self.between is not None:
            self.between[:] = np.nan
            self.between[0] = self.states
        if n == 0:
            return
        from sim.crowd.forces_goal_kernels import accelerate

        noise.take(self.columns, axis=0, out=self.people.noise, mode="clip")
        given = self.state, *self.people, *self.groups.arrays, *self.obstacles, STEP_TIME, self.force[:n]
        for step in range(1, STEPS + 1):
            if not accelerate(*given):
                raise WorkError(
                    file=self.scenario.name, place=f"seed {self.seed}", got="a position or velocity that is not finite",
                    expected="finite motion", remedy="report the scenario and seed as a bug",
                )  # fmt: skip
            pymunk.batch.set_space_bodies(self.space, WRITE, self._write_buffer)
            self.space.step(STEP_TIME)
            self._read(READ)
            if self.between is not None:
                self.between[step, self.columns] = self.state
        self.groups.everybody.gait[self.columns] = self.people.gait

    def _move_doors(self, tick: int) -> None:
        """Makes walls of the doors that are shut since this tick of the recording, and openings of the others."""
        walls = self.doors.walls()
        self.walls = [*(row for row in self.walls if row[0] < tick), (tick, walls)]
        self.obstacles = self.obstacles._replace(walls=walls.reshape(-1, 4))
        for k, shut in enumerate(self.doors.shut.tolist()):
            if shut and k not in self.shut:
                self.shut[k] = _add_wall(self.space, self.scene.doors[k])
            elif not shut and k in self.shut:
                self.space.remove(self.shut.pop(k))

    def _come_and_go(self, t: float, first: bool) -> None:
        """Removes people who leave at time t (s, negative in the warm-up), and adds groups that enter."""
        if not len(self.columns) and not self.waiting:
            return
        gone = self.groups.remove_leaving(self.columns)
        coming = [g for g in self.waiting if g.enter <= t or (first and g.enter == 0)]
        # A group waits while people stand at its place.
        shut = set() if first else {group.head for group in coming if not self._has_room(group)}
        coming = [group for group in coming if group.head not in shut]
        if not gone and not coming:
            return
        for column in gone:
            body = self.bodies.pop(column)
            self.space.remove(body, *body.shapes)
        for group in coming:
            self.waiting.remove(group)
            self.groups.enter(group)
            heading = self.groups.arrays.heading[group.index]
            # A walking group starts back on its way if that is free, to be at its start when the recording begins.
            far = self.scenario.warmup * group.speed * heading
            early = first and group.enter == 0 and group.walks and not len(self.scene.pillars)
            whole = (
                np.concatenate([part.pos for part in self.entering if part.head == group.head]) if early else group.pos
            )
            back = early and not blocked(whole, whole - far, self.scene.walls).any()
            start = group.pos - far if back else group.pos
            velocity = group.speed * heading if group.walks else heading * 0
            for member, pos in zip(group.members, start, strict=True):
                self.bodies[member.column] = self._body(pos, velocity)
        self._map_rows()

    def _has_room(self, group: EnteringGroup) -> bool:
        d = length(group.pos[:, None] - self.state[None, :, :2])
        return bool(d.min(initial=np.inf) > ENTRY_GAP * BODY_RADIUS)

    def _body(self, pos: Array, velocity: Array) -> pymunk.Body:
        body = pymunk.Body(1.0, float("inf"))
        body.position = float(pos[0]), float(pos[1])
        body.velocity = float(velocity[0]), float(velocity[1])
        disc = pymunk.Circle(body, BODY_RADIUS)
        disc.friction = 0.0
        self.space.add(body, disc)
        return body

    def _map_rows(self) -> None:
        """Rebuilds columns, state, force and people after bodies came or went, in the physics engine's order."""
        self._read(pymunk.batch.BodyFields.BODY_ID)
        ids = np.frombuffer(self._read_buffer.int_buf(), dtype=np.uintp)
        column = {body.id: c for c, body in self.bodies.items()}
        n = len(self.bodies)
        assert all(int(i) in column for i in ids[:n]), "static bodies must come after all others"
        self.columns = np.array([column[int(i)] for i in ids[:n]], dtype=np.int64)
        self.force = np.zeros((len(ids), 2))
        self._write_buffer.set_float_buf(self.force)
        self._read(READ)
        self.state = np.frombuffer(self._read_buffer.float_buf()).reshape(-1, 4)[:n]
        self.people = self.groups.rows(self.columns)
        self.states[:], self.group_of[:] = np.nan, -1

    def _read(self, fields: pymunk.batch.BodyFields) -> None:
        self._read_buffer.clear()
        pymunk.batch.get_space_bodies(self.space, fields, self._read_buffer)

    def _motion(
        self, ticks: Array, groups: Ints, state: Array, intent: Ints, frames: FrameTimes, waiting: Bools | None
    ) -> Motion:
        """Returns the Motion of states and group indices at the ticks, and in the frames."""
        height = np.array([m.height for m in self.members])
        pos, vel = ticks[..., :2], ticks[..., 2:]
        present = np.isfinite(pos[..., 0])
        facing = facings(pos, vel, present, groups, SCRIPT_RATE)
        measured = States(SCRIPT_RATE, pos, vel, headings(facing), present, groups, tuple(self.walls), waiting)
        there = np.isfinite(state[..., 0])
        if self.between is None:
            # All frames lie on ticks.
            heading = measured.heading[: len(state)]
        else:
            heading = np.where(there, headings(frames.between_ticks(facing, present)), np.nan)
        return Motion(
            name=self.scenario.name, seed=self.seed, repeat=self.repeat, fps=self.scenario.camera.fps,
            pos=state[..., :2], vel=state[..., 2:], heading=heading, present=there, intent=intent, height=height,
            width=SHOULDER_SHARE * height, depth=DEPTH_SHARE * height,
            free_speed=np.array([m.free_speed for m in self.members]), scene=self.scene,
            orders=self.orders.record(frames), measured=measured, unfired=self.orders.unfired(),
            clothes=np.array([m.clothes for m in self.members]),
        )  # fmt: skip


def _add_wall(space: pymunk.Space, wall: Array) -> pymunk.Segment:
    segment = pymunk.Segment(space.static_body, tuple(wall[0]), tuple(wall[1]), 0.02)
    segment.friction = 0.0
    space.add(segment)
    return segment


def _space(scene: Scene) -> pymunk.Space:
    space = pymunk.Space()
    space.collision_slop = 0.005
    space.collision_bias = OVERLAP_LEFT
    for wall in scene.walls:
        _add_wall(space, wall)
    for x, y, r in scene.pillars:
        pillar = pymunk.Circle(space.static_body, float(r), (float(x), float(y)))
        pillar.friction = 0.0
        space.add(pillar)
    return space
