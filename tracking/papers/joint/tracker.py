"""`joint`: individuals and groups tracked jointly by a decentralised particle filter (DEEPER-JIGT).

Bazzani, Cristani, Murino, "Decentralized particle filter for joint individual-group tracking", CVPR Workshops 2012. The
steps of a frame are those of its Algorithm 1. docs/trackers/joint.md has the equations with their modules, and the
departures.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from sim.truth.group_ids_and_changes import Members
from sim.types import Array, Bools, Context, Detections, Frame, Ints, Tracks
from tracking.detect.point_detections import PointTracker, boxes_at, followed_sizes
from tracking.filters import existence
from tracking.filters.person_streams import NOBODY, PersonStreams
from tracking.grouping.belief import EVENTS, default_belief
from tracking.grouping.online_belief import PairBelief
from tracking.papers.joint import decentralised_filter, report
from tracking.papers.joint.config import CONFIRMED, LEAST_PRESENCE, REPORTED, SCALES, SHARPNESS, JointConfig
from tracking.papers.joint.decentralised_filter import Nested
from tracking.papers.joint.distributions import (
    BIRTHS,
    PARTITIONS,
    PLACING,
    RESAMPLING,
    STATE,
    FrameModel,
)
from tracking.papers.joint.division_kernels import place_newcomers
from tracking.papers.joint.individuals import moved, process_noise
from tracking.papers.joint.people import Newcomers, People, associate
from tracking.papers.joint.report import OWN_EVENTS, ReportedEvents


class Joint(PointTracker):
    """The tracker `joint`: people and the groups they form, from points or from pixels.

    Made from a config; None: the defaults. State: config, which may be replaced between two frames; nested, the
    particles after step 2; people, the tracked people; newcomers, people who are not confirmed yet; groups, the people
    of each reported group, by id; events, which makes the events; belief, of pairs; streams, the random numbers; shown
    (K, 4), boxes of the people reported last, px, or None; reported, the ids of all people reported so far.
    """

    config_class: ClassVar[type[JointConfig]] = JointConfig

    def __init__(self, config: JointConfig | None = None) -> None:
        self.config = config or JointConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forgets everything and starts a sequence. seed: of all random numbers. With a background sample in the
        context pixels are tracked, else points. Raises InputError as `begin`."""
        c = self.config
        self.begin(context, divide=False)
        self.shown: Array | None = None
        self.nested = Nested.empty((c.particles, c.partitions), STATE)
        self.people, self.newcomers = People(), Newcomers()
        self.groups: Members = {}
        self.reported = set[int]()
        self.events = ReportedEvents(context.fps)
        self.belief = PairBelief(context.fps, EVENTS)
        self.streams = PersonStreams(seed)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the people of the frame and their groups as Tracks; updates all particles.

        From points `detections.pos` is used (x, y, finite), from pixels `frame.image`. In a frame without them (None),
        and from pixels in one with too much foreground, nobody counts as missed. Raises InputError if points are in the
        image and the context has no scale above 0, or if the picture's size or dtype is not the background sample's.
        """
        detections = self.detected(frame, detections, self.shown)
        self.streams.frame += 1
        points, sizes = (np.zeros((0, 2)),) * 2 if detections is None else self.points(detections)
        change = existence.transition(self.dt, self.config.hidden_time)
        self.people.pass_time(change)
        self.newcomers.pass_time(change)
        self.newcomers.predict(self.dt)
        rows, columns, density = self._associate(points)
        z = np.full((len(self.people.id), 2), np.nan)
        z[rows] = points[columns]
        if detections is not None:
            self.people.weigh(rows, density, self.config.detect_prob)
            self.people.size[rows] = followed_sizes(self.people.size[rows], sizes[columns], self.dt)
        self._filter(z)
        tracks = self._report(frame, np.isfinite(z[:, 0]))
        self._resample()
        if detections is not None:
            free = np.setdiff1d(np.arange(len(points)), columns)
            self._keep(self.people.states.sum(axis=1) >= LEAST_PRESENCE)
            self._newcomers(points[free], sizes[free])
        return self.in_picture(tracks)

    def _associate(self, points: Array) -> tuple[Ints, Ints, Array]:
        c, ahead = self.config, moved(self.nested.x, self.dt)
        mean, cov = report.moments(ahead, np.full(ahead.shape[:2], 1 / len(ahead)))
        spread = process_noise(c.place_noise, c.velocity_noise, self.dt)[0] * np.eye(2)
        odds = self.people.odds(c.detect_prob, self.dt)
        return associate(mean[:, :2], cov[:, :2, :2] + spread, points, self.noise, odds)

    def _filter(self, z: Array) -> None:
        if not len(z):
            return
        beliefs = remembered(self.belief.log_odds, *self._before(), self.config.belief_memory)
        model = FrameModel(self.config, self.dt, self.noise, z, beliefs, self.streams, self.people.key)
        uniforms = self.streams.uniforms(PARTITIONS, NOBODY, 1, self.config.particles)[0, 0]
        self.nested = decentralised_filter.advance(self.nested, model, uniforms)

    def _before(self) -> tuple[Ints, Array]:
        id = self.people.id
        known = np.isin(id, np.array(sorted(self.events.people.identities.people), np.int64)).astype(float)
        return report.known_groups(self.groups, id), known

    def _resample(self) -> None:
        if len(self.people.id):
            uniforms = self.streams.uniforms(RESAMPLING, np.append(self.people.key, NOBODY), 1, 1)[0, :, 0]
            self.nested = self.nested.resampled(uniforms, self.config.own_weights)

    def _keep(self, rows: Bools) -> None:
        if rows.all():
            return
        self.nested = self.nested.kept(rows)
        self.people.keep(rows)
        self.belief.keep(rows)
        self.events.belief.keep(rows)

    def _newcomers(self, points: Array, sizes: Array) -> None:
        new = self.newcomers
        free = new.measure(points, sizes, self.noise, self.config.detect_prob, self.dt)
        new.start(points[free], sizes[free], self.noise, self.streams.frame, self.dt)
        sure = new.existence >= CONFIRMED
        if sure.any():
            self._add(sure)
        new.keep(~sure & (new.states.sum(axis=1) >= LEAST_PRESENCE))

    def _add(self, rows: Bools) -> None:
        c, key = self.config, self.newcomers.key[rows]
        normals = self.streams.normals(BIRTHS, key, c.particles, STATE)
        if c.individuals == "measured":
            normals[:] = 0.0
        self.nested = n = self.nested.joined(self.newcomers.draw(rows, normals))
        self.people.add(self.newcomers, rows)
        self.belief.add(n.x.mean(axis=0))
        self.events.belief.add(n.x.mean(axis=0))
        uniforms = self.streams.uniforms(PLACING, key, n.log_q.size, 1).reshape(*n.log_q.shape, len(key))
        place_newcomers(n.x, n.z, uniforms, SHARPNESS, SCALES)

    def _report(self, frame: Frame, seen: Bools) -> Tracks:
        n, c, id = self.nested, self.config, self.people.id
        mean, cov = report.moments(n.x, n.component_weights(c.own_weights))
        self.belief.see(mean[:, :2])
        self.events.add(frame.index, id, mean[:, :2], seen)
        events = self.events.events(self.groups, self.unit)
        parts = [frozenset(id[rows].tolist()) for rows in self._groups()]
        self.groups = self.events.people.identities.name(frame.index, parts, self.groups)
        shown = self.people.existence >= REPORTED
        id, group, mean, cov = id[shown], report.known_groups(self.groups, id[shown]), mean[shown], cov[shown]
        self.reported.update(id.tolist())
        # a person may be confirmed, missed and forgotten without being reported
        events = tuple(e for e in events if self.reported.issuperset(e.members))
        pos, vel, cov = mean[:, :2] * self.unit, mean[:, 2:] * self.unit, cov * self.unit**2
        self.shown = boxes_at(pos, self.people.size[shown]) if self.plane == "image" else None
        return Tracks(
            frame.index, frame.t, self.plane, "person", id, group, pos, vel, cov, self.shown, np.ones(len(id)),
            report.no_groups(group), events, own_events=OWN_EVENTS, seen=seen[shown],
        )  # fmt: skip

    def _groups(self) -> list[Ints]:
        n = self.nested
        particle = n.weights(self.config.own_weights)
        return report.histogram_partition(n.z, particle[:, None] * np.exp(n.log_q)) if n.z.shape[2] else []


def remembered(log_odds: Array, group: Ints, known: Array, share: float) -> Array:
    """Returns the log-odds (K, K) of pairs, raised for people who were in one group and lowered for others. group (K,):
    estimated group, -1 alone; known (K,): 1 for people tracked before, else 0. share: factor of the change."""
    belief = default_belief()
    same = (group[:, None] >= 0) & (group[:, None] == group)
    return np.asarray(log_odds + share * np.outer(known, known) * np.where(same, belief.stay, -belief.come))
