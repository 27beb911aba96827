"""`particle` and `relational`: people tracked by a particle filter, without and with who walks together.

Cattelani, Manfredotti, Messina, "Multiple object tracking with relations", ICPRAM 2012. The steps of a frame are
forecast, weight, deaths, births, estimate, resample. docs/trackers/relational.md has the equations with their modules,
and the departures.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from sim.types import Array, Bools, Context, Detections, Frame, Ints, Tracks
from tracking.detect.point_detections import PersonTable, PointTracker, boxes_at, followed_sizes
from tracking.filters import existence
from tracking.filters.person_streams import PersonStreams, birth_keys
from tracking.grouping.belief import UNSEEN
from tracking.grouping.online_belief import PairBelief
from tracking.papers.relational import particle_set, particle_set_kernels, sensor, transition_kernels
from tracking.papers.relational.config import ParticleConfig, RelationalConfig
from tracking.papers.relational.occluders import covered_by_people, hidden_share
from tracking.papers.relational.particle_set import ParticleSet
from tracking.papers.relational.transition_kernels import DISTANCE, VELOCITY

# People with own weights are resampled if their effective number is at most this share of the particles (ours).
RESAMPLE_SHARE = 0.5
# Least probability that a detection is nobody's for it to start a person; the paper does not say which starts one.
BIRTH_DOUBT = 0.5
LEAST_EXISTENCE = 0.02  # A person whose existence is less probable is removed (ours).
# m: half the width of a body that hides others from a known camera (ours); not with the paper's sensor.
BODY_RADIUS = 0.25
SPEED_PRIOR = 1.3  # m/s: standard deviation of a new person's velocity, per axis, that of walking people.
# What random numbers are drawn for. Relations have streams of their own, so that they change no other draw.
MOTION, BIRTHS, RESAMPLING, SPREAD, RELATIONS, JOINING, COUPLING = range(7)


@dataclass
class Slots(PersonTable):
    """The people of a sequence, one row for each of K slots of the particles (all ours).

    id (K,): the track's id, -1 until the person is first reported. missed (K,): time without a measurement in which the
    person could have been seen, s. seen (K,): True if measured in the last frame with a measurement. next_id: the next
    new id.
    """

    missed: Array = field(default_factory=lambda: np.zeros(0))
    id: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    seen: Bools = field(default_factory=lambda: np.zeros(0, bool))
    next_id: int = 1

    def measure(self, seen: Array, pairs: Array, sizes: Array, dt: Array) -> None:
        """Records who was measured in a frame: people with seen (K,), a probability, above 1/2; the others were missed
        for dt (K,) s more. pairs (K, M): probability of each detection; sizes (M, 2): of boxes, px."""
        self.seen = seen > 0.5
        self.missed = np.where(self.seen, 0.0, self.missed + dt)
        if not pairs.size:
            return
        best = pairs.argmax(axis=1)
        sure = pairs[np.arange(len(best)), best] > 0.5
        self.size[sure] = followed_sizes(self.size[sure], sizes[best[sure]], dt[sure, None])

    def name(self, rows: Bools) -> None:
        """Gives new ids to the people where `rows` (K,) is True and who have no id yet."""
        new = np.flatnonzero(rows & (self.id < 0))
        self.id[new] = self.next_id + np.arange(len(new))
        self.next_id += len(new)


class Particle(PointTracker):
    """The tracker `particle`: a particle filter of people who move independently of each other.

    Made from a config; None: the defaults. State: config, which may be replaced between two frames; particles; slots,
    the people; streams, the random numbers of each person; hidden (K,): probability that each person is behind a known
    pillar or wall, or behind another person; cut (K,): that the feet are behind another person; shown: the tracks
    reported last, None before.
    """

    config_class: ClassVar[type[ParticleConfig]] = ParticleConfig

    def __init__(self, config: ParticleConfig | None = None) -> None:
        self.config = config or self.config_class()

    def reset(self, context: Context, seed: int) -> None:
        """Forgets everything and starts a sequence. seed: of all random numbers. With a background sample in the
        context pixels are tracked, else points. Raises InputError as `begin`."""
        self.begin(context, divide=True)
        self.shown: Tracks | None = None
        self.particles, self.slots = ParticleSet.empty(self.config.particles), Slots()
        self.streams = PersonStreams(seed)
        self.hidden = np.zeros(0)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the people of the frame as Tracks; updates all particles.

        From points `detections.pos` is used (x, y), from pixels `frame.image`. A frame without them (None), and from
        pixels one with too much foreground, is forecast only; no detections are a frame in which everybody is missed.
        Raises InputError if points are in the image and the context has no scale above 0, or if the picture's size or
        dtype is not the background sample's.
        """
        detections = self.detected(frame, detections, None if self.shown is None else self.shown.box)
        self.streams.frame += 1
        self._forecast()
        if detections is not None:
            self._measure(detections)
        self.shown = tracks = self._report(frame, detections is not None)
        if detections is not None:
            one = self.particles.one_weight
            few = self.particles.resample(1.0 if one else RESAMPLE_SHARE, self._uniforms)
            if not one and len(few):
                self.particles.spread(few, self._normals(few))
        return self.in_picture(tracks)

    def _forecast(self) -> None:
        p, c = self.particles, self.config
        noise = self.streams.normals(MOTION, self.slots.key, p.count, 2)
        shared, coupling, alike, spread = self._coupling()
        table = c.speed_table(self.dt)
        transition_kernels.move(
            p.pos, p.vel, p.exist, p.pairs, p.related, noise, shared, table, coupling, alike, spread, self.dt
        )
        camera = self.context.camera if self.plane == "ground" else None
        self.hidden = hidden_share(p.pos, p.weights, camera, self.context.scene)
        behind, self.cut = covered_by_people(p, camera, 0.0 if c.certain_sensor else BODY_RADIUS)
        self.hidden = 1 - (1 - self.hidden) * (1 - behind)
        self._relate()

    @property
    def eye(self) -> Array:
        """Place of the camera on the ground, (2,), m; nan if there is none or it looks straight down."""
        camera = self.context.camera if self.plane == "ground" else None
        return camera.position[:2] if camera is not None and camera.kind == "pinhole" else np.full(2, np.nan)

    def _coupling(self) -> tuple[Array, Array, Array, Array]:
        return np.zeros(self.particles.pos.shape), np.zeros(2), np.zeros(4), np.zeros((0, 2))

    def _relate(self) -> None: ...

    def _measure(self, detections: Detections) -> None:
        points, sizes = self.points(detections)
        sight = self._detection_probability(), ~self.slots.seen, self.cut, self.eye
        pairs, measured, nobody = sensor.weigh(self.particles, points, *sight, self.noise, self.config)
        self.slots.measure(measured, pairs, sizes, self.dt * (1 - self.hidden))
        self._remove()
        new = nobody >= BIRTH_DOUBT
        if new.any():
            self._start(points[new], sizes[new])

    def _detection_probability(self) -> Array:
        c = self.config
        again = c.detect_prob if c.certain_sensor else min(c.detect_prob, -np.expm1(-self.dt / c.hidden_time))
        visible = 1.0 if c.certain_sensor else 1 - self.hidden
        return np.asarray(np.where(self.slots.seen, c.detect_prob, again) * visible)

    def _remove(self) -> None:
        keep = (self.particles.existence >= LEAST_EXISTENCE) & (self.slots.missed <= self.config.time_window + 1e-9)
        if not keep.all():
            self._keep(keep)

    def _keep(self, rows: Bools) -> None:
        self.particles.keep(rows)
        self.slots.keep(rows)

    def _start(self, points: Array, sizes: Array) -> None:
        p, c, key = self.particles, self.config, birth_keys(points, self.streams.frame)
        draws = self.streams.normals(BIRTHS, key, 2 * p.count, 2).reshape(2, p.count, len(points), 2)
        exist = c.birth_rate * self.dt / (c.birth_rate * self.dt + c.clutter_density)
        p.add(points + self.noise * draws[0], SPEED_PRIOR * draws[1], exist)
        missed, unnamed, seen = np.zeros(len(key)), np.full(len(key), -1), np.ones(len(key), bool)
        self.slots.extend(missed=missed, id=unnamed, seen=seen, size=sizes, key=key)
        self._relate_newcomers(points)

    def _uniforms(self, people: Ints) -> Array:
        return np.asarray(self.streams.uniforms(RESAMPLING, self.slots.key[people], 1, self.particles.count)[0])

    def _normals(self, people: Ints) -> Array:
        key, count = self.slots.key[people], self.particles.count
        return self.streams.normals(SPREAD, key, 1, 4 * count).reshape(len(key), 4, count)

    def _relate_newcomers(self, points: Array) -> None: ...

    def _report(self, frame: Frame, measured: bool) -> Tracks:
        mean, cov, exist = self.particles.estimates()
        exist = exist * self._stayed()
        rows = exist >= self.config.report_existence
        self.slots.name(rows)
        self._follow(np.where(rows[:, None], mean, np.nan))
        pos, vel, cov = mean[rows, :2], mean[rows, 2:], cov[rows]
        score, id = np.minimum(exist[rows], 1.0), self.slots.id[rows]
        if self.plane == "image":
            pos, vel, cov = pos * self.unit, vel * self.unit, cov * self.unit**2
        box = boxes_at(pos, self.slots.size[rows]) if self.plane == "image" else None
        alone, seen = np.full(len(id), -1), self.slots.seen[rows] & measured
        return Tracks(frame.index, frame.t, self.plane, "person", id, alone, pos, vel, cov, box, score, seen=seen)

    def _stayed(self) -> Array:
        """Returns the probability (K,) that each person has not left: hidden since the last measurement against gone
        then, by the rates of `existence`; 1 if measured or with the paper's sensor."""
        c, seen = self.config, self.slots.seen
        if seen.all() or c.certain_sensor:
            return np.ones(len(seen))
        # people leave with their partners: whose partner is measured is hidden
        alone = 1 - (self.particles.together() * seen).max(axis=1, initial=0.0)
        gone = alone * existence.SHOWN_TIME / existence.LIFETIME * np.exp(self.slots.missed / c.hidden_time)
        return np.where(seen, 1.0, 1 / (1 + gone))

    def _follow(self, state: Array) -> None: ...


# Rules of transition_kernels by which every partner counts fully, as in the paper.
ALWAYS = np.array([0.0, np.inf, 0.0, 0.0])


class Relational(Particle):
    """The tracker `relational`: the particle filter of `particle` with the relation "walking together" in it.

    together (K, K): probability that each pair walks together, in the last frame, by slots; 1 on the diagonal. belief:
    that of tracking.grouping about the slots' tracks so far, kept only if relations come from it. The rest of the state
    is that of Particle.
    """

    config_class: ClassVar[type[ParticleConfig]] = RelationalConfig
    config: RelationalConfig

    def reset(self, context: Context, seed: int) -> None:
        """Forgets everything and starts a sequence, as `Particle.reset`."""
        super().reset(context, seed)
        self.together = np.zeros((0, 0))
        self.belief = PairBelief(context.fps) if self.config.relation_evidence == "belief" else None

    @property
    def _rules(self) -> Array:
        c = self.config
        new = -np.expm1(-c.relation_rate * self.dt)
        return np.array([new, c.relation_bias, c.relation_distance, c.relation_velocity])

    def _coupling(self) -> tuple[Array, Array, Array, Array]:
        p, time = self.particles, self.config.coupling_time
        follow = 1.0 if time == 0 else -math.expm1(-self.dt / time)
        coupling = np.array([follow, self.config.common_noise])
        shared = self.streams.normals(COUPLING, self.slots.key, p.count, 2)
        p.drop_strangers()
        if self.belief is None:
            return shared, coupling, ALWAYS, np.zeros(p.pairs.shape)
        return shared, coupling, self._rules, transition_kernels.pair_spread(p.pos, p.vel, p.pairs)

    def _relate(self) -> None:
        p, rules = self.particles, self._rules
        if p.people < 2:
            return
        if self.belief is None:
            p.hold(particle_set.near_pairs(p.pos, rules))
            odds = np.full(len(p.pairs), self.config.relation_bias)
        else:
            log_odds, seen = _log_odds(self.belief), self.belief.seen()
            p.hold(np.argwhere(np.triu(np.isfinite(log_odds), 1)))
            odds = np.where(seen[p.pairs].all(axis=1), log_odds[p.pairs[:, 0], p.pairs[:, 1]], np.nan)
            rules = np.where(np.isin(range(4), (DISTANCE, VELOCITY)), 0.0, rules)
        uniforms = self.streams.uniforms(RELATIONS, self.slots.key, p.count, 2)
        transition_kernels.relate(p.pos, p.vel, p.pairs, p.related, odds, uniforms, rules)
        if self.belief is None:
            p.close_groups()

    def _follow(self, state: Array) -> None:
        if self.belief is not None:
            if len(state) > len(self.belief.count):
                self.belief.add(state)
            self.belief.see(state[:, :2])

    def _keep(self, rows: Bools) -> None:
        super()._keep(rows)
        if self.belief is not None:
            self.belief.keep(rows)

    def _relate_newcomers(self, points: Array) -> None:
        p, new = self.particles, len(points)
        label = np.empty(p.exist.shape, np.int64)
        particle_set_kernels.group_labels(p.pairs, p.related, label)
        uniforms = self.streams.uniforms(JOINING, self.slots.key[-new:], 1, p.count)[0]
        pairs, related = particle_set.join(p.pos, p.exist, label, points, uniforms, self._rules)
        p.pairs, p.related = np.concatenate([p.pairs, pairs]), np.concatenate([p.related, related])

    def _report(self, frame: Frame, measured: bool) -> Tracks:
        tracks, p = super()._report(frame, measured), self.particles
        if self.belief is None:
            self.together = p.together()
        else:
            self.together = 1 / (1 + np.exp(-_log_odds(self.belief)))
            np.fill_diagonal(self.together, 1.0)
        return tracks

    def walking_together(self) -> tuple[Ints, Array]:
        """Returns ids (R,) of the people reported last, and the probability (R, R) that two of them walk together.

        With the config's `relation_evidence` "state": the share of the weight of the particles in which the pair is
        related, given that both exist. With "belief": the belief's probability, which is the same in all particles; a
        share of particles would add errors of sampling, and weights would count the detections twice. 1 on the
        diagonal.
        """
        rows = np.zeros(0, np.int64) if self.shown is None else np.flatnonzero(np.isin(self.slots.id, self.shown.id))
        return self.slots.id[rows], self.together[np.ix_(rows, rows)]


def _log_odds(belief: PairBelief) -> Array:
    return np.where(belief.log_odds == UNSEEN, -np.inf, belief.log_odds)
