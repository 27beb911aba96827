"""The dynamics: a scenario and a seed become a Motion. The only module that knows pymunk.

Bodies are discs of BODY_RADIUS and weigh 1, so that a force is an acceleration; the space resolves contacts. State is
read and forces are written in batches (`pymunk.batch`), rows being mapped to people after each coming and going.
Nothing sets a position or a velocity after a person has come; a frame is the state after the step that ends at it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pymunk
import pymunk.batch

from scenarios.errors import WorkError
from scenarios.schema.scenario import Scenario
from sim.crowd.navigation import Navigator, scene_of
from sim.crowd.population import BODY_RADIUS, Party, cast
from sim.crowd.script import Script
from sim.crowd.steering import Groups, Obstacles, People, Steering
from sim.crowd.wander import wander
from sim.types import Array, Ints, Motion, Scene

MAX_STEP = 0.02  # s
WIDTH, DEPTH = 0.27, 0.16  # shoulder width and depth of a body, shares of its height
READ = pymunk.batch.BodyFields.POSITION | pymunk.batch.BodyFields.VELOCITY
WRITE = pymunk.batch.BodyFields.FORCE


def run(scenario: Scenario, seed: int, repeat: int = 0, steering: Steering | None = None) -> Motion:
    """The whole motion of a scenario; InputError where it cannot begin, WorkError where it blows up."""
    world = World(scenario, seed, repeat, steering or Steering())
    return world.run()


def steps_per_frame(fps: float) -> int:
    """The least number of physics steps per frame that keeps a step within MAX_STEP."""
    return max(1, math.ceil(1 / (fps * MAX_STEP) - 1e-9))


class World:
    """A scenario in motion. State: the space, the kernel's arrays for those present, the script, the record."""

    def __init__(self, scenario: Scenario, seed: int, repeat: int, steering: Steering) -> None:
        self.scenario, self.seed, self.repeat = scenario, seed, repeat
        self.scene: Scene = scene_of(scenario.world)
        self.parties: list[Party] = cast(scenario, self.scene, seed, repeat)
        self.members = [m for p in self.parties for m in p.members]
        self.fps = scenario.camera.fps
        self.substeps = steps_per_frame(self.fps)
        self.dt = 1 / (self.fps * self.substeps)
        self.parameters = steering.array()
        self.navigator = Navigator(self.scene)
        self.script = Script(scenario, self.parties, self.navigator, seed, repeat)
        self.groups: Groups = self.script.groups
        self.push = np.zeros((len(self.groups.speed), 2))
        self.obstacles = _obstacles(self.scene, scenario)
        self.space = _space(self.scene)
        self.bodies: dict[int, pymunk.Body] = {}
        self.columns = np.zeros(0, np.int64)
        self.everybody = np.full((len(self.members), 4), np.nan)
        self.group_of = np.full(len(self.members), -1, np.int64)
        self.people = People.empty(0)
        self.state = np.zeros((0, 4))
        self.force = np.zeros((0, 2))
        self._get, self._put = pymunk.batch.Buffer(), pymunk.batch.Buffer()

    def run(self) -> Motion:
        """Warm up, then record duration · fps frames."""
        frames = max(1, round(self.scenario.duration * self.fps))
        record = np.empty((frames, len(self.members), 4))
        intent = np.empty((frames, len(self.members)), np.int64)
        for f, (state, group) in enumerate(self.frames(frames)):
            record[f], intent[f] = state, group
        return self._motion(record, intent)

    def frames(self, length: int) -> Iterator[tuple[Array, Ints]]:
        """After the warm-up, `length` times (P, 4) x, y, vx, vy and (P,) group, nan and -1 where absent.

        Both are filled anew for the next frame.
        """
        from sim.crowd.forces import accelerate

        warm = round(self.scenario.warmup * self.fps)
        noise = wander([m.key for m in self.members], warm + length, self.fps, self.seed, self.repeat)
        for f in range(-warm, length):
            if f > -warm:
                self._advance(accelerate, noise[f + warm])
            t = f / self.fps
            self._come_and_go(t, f == -warm)
            if f < 0:
                continue
            self.everybody[self.columns] = self.state
            self.group_of[self.columns] = self.script.group_of[self.columns]
            if self.script.advance(f, t, self.everybody):
                self._retag()
            yield self.everybody, self.group_of

    def _advance(self, accelerate: Any, noise: Array) -> None:
        """One frame: `substeps` of forces, physics and reading back."""
        n = len(self.columns)
        if n == 0:
            return
        noise.take(self.columns, axis=0, out=self.people.wander, mode="clip")
        out = self.force[:n]
        for _ in range(self.substeps):
            if not accelerate(
                self.state, self.people, self.groups, self.obstacles, self.dt, self.parameters, self.push, out
            ):
                raise self._blown_up()
            pymunk.batch.set_space_bodies(self.space, WRITE, self._put)
            self.space.step(self.dt)
            self._get.clear()
            pymunk.batch.get_space_bodies(self.space, READ, self._get)
        self.script.waypoint[self.columns] = self.people.tag[:, 3]

    def _blown_up(self) -> WorkError:
        return WorkError(
            file=self.scenario.name,
            place=f"seed {self.seed}",
            got="a position or velocity that is not finite",
            expected="finite motion",
            remedy="report the scenario and seed as a bug",
        )

    def _read(self) -> Array:
        """(rows, 4) x, y, vx, vy: the engine's own buffer, which every further reading of as many bodies fills anew."""
        self._get.clear()
        pymunk.batch.get_space_bodies(self.space, READ, self._get)
        return np.frombuffer(self._get.float_buf()).reshape(-1, 4)

    def _come_and_go(self, t: float, first: bool) -> None:
        gone = self.script.leaving(self.columns)
        coming = [party for party in self.script.waiting if (party.enter <= 0 if first else party.enter <= t)]
        coming = [party for party in coming if first or self._has_room(party)]
        if not gone and not coming:
            return
        for column in gone:
            body = self.bodies.pop(column)
            self.space.remove(body, *body.shapes)
        for party in coming:
            self.script.enter(party)
            heading = self.groups.heading[party.index]
            back = self.scenario.warmup * party.speed * heading if first and self._free_way(party, heading) else 0.0
            for member, pos in zip(party.members, party.pos - back, strict=True):
                self.bodies[member.column] = self._body(
                    pos, party.speed * heading if self.script.walks(party) else heading * 0
                )
        self._map_rows()

    def _free_way(self, party: Party, heading: Array) -> bool:
        from sim.crowd.navigation import blocked

        if not self.script.walks(party):
            return False
        back = party.pos - self.scenario.warmup * party.speed * heading
        return not blocked(party.pos, back, self.scene.walls).any() and not len(self.scene.pillars)

    def _has_room(self, party: Party) -> bool:
        if not len(self.state):
            return True
        d = np.linalg.norm(party.pos[:, None] - self.state[None, :, :2], axis=2)
        return bool(d.min() > 2.2 * BODY_RADIUS)

    def _body(self, pos: Array, velocity: Array) -> pymunk.Body:
        body = pymunk.Body(1.0, float("inf"))
        body.position = float(pos[0]), float(pos[1])
        body.velocity = float(velocity[0]), float(velocity[1])
        disc = pymunk.Circle(body, BODY_RADIUS)
        disc.friction = 0.0
        self.space.add(body, disc)
        return body

    def _map_rows(self) -> None:
        """Find which row of a batch is whom; dynamic bodies come first, in an order of the engine's own."""
        self._get.clear()
        pymunk.batch.get_space_bodies(self.space, pymunk.batch.BodyFields.BODY_ID, self._get)
        ids = np.frombuffer(self._get.int_buf(), dtype=np.uintp)
        column = {body.id: c for c, body in self.bodies.items()}
        n = len(self.bodies)
        assert all(int(i) in column for i in ids[:n]), "static bodies must come after all others"
        self.columns = np.array([column[int(i)] for i in ids[:n]], dtype=np.int64)
        self.force = np.zeros((len(ids), 2))
        self._put.set_float_buf(self.force)
        self.state = self._read()[:n]
        self.people = People.empty(n)
        self.everybody[:], self.group_of[:] = np.nan, -1
        self._retag()

    def _retag(self) -> None:
        """Bring the kernel's arrays up to the script: groups, places, targets."""
        self.script.fill(self.people, self.columns)

    def _motion(self, record: Array, intent: Any) -> Motion:
        from sim.crowd.heading import headings

        height = np.array([m.height for m in self.members])
        pos, vel = record[:, :, :2], record[:, :, 2:]
        present = np.isfinite(pos[:, :, 0])
        return Motion(
            name=self.scenario.name,
            seed=self.seed,
            repeat=self.repeat,
            fps=self.fps,
            pos=pos,
            vel=vel,
            heading=headings(pos, vel, present, intent, self.fps),
            present=present,
            intent=intent,
            height=height,
            width=WIDTH * height,
            depth=DEPTH * height,
            free_speed=np.array([m.free_speed for m in self.members]),
            scene=self.scene,
            orders=self.script.orders(),
        )


def _obstacles(scene: Scene, scenario: Scenario) -> Obstacles:
    stairs = np.zeros((len(scene.stairs), 8))
    for row, s, spec in zip(stairs, scene.stairs, scenario.world.stairs, strict=True):
        along = s.head - s.foot
        length = float(np.linalg.norm(along))
        row[:] = (*s.foot, *(along / length), length, s.width, spec.slowdown, s.landing)
    return Obstacles(np.array(scene.walls).reshape(-1, 4), np.array(scene.pillars), stairs)


def _space(scene: Scene) -> pymunk.Space:
    space = pymunk.Space()
    space.collision_slop = 0.005
    for wall in scene.walls:
        segment = pymunk.Segment(space.static_body, tuple(wall[0]), tuple(wall[1]), 0.02)
        segment.friction = 0.0
        space.add(segment)
    for x, y, r in scene.pillars:
        pillar = pymunk.Circle(space.static_body, float(r), (float(x), float(y)))
        pillar.friction = 0.0
        space.add(pillar)
    return space
