"""`joint`: individuals and groups tracked jointly by a decentralised particle filter (DEEPER-JIGT).

Bazzani, Cristani, Murino, "Decentralized particle filter for joint individual-group tracking", CVPR Workshops 2012. The
state is (X, Z): X places and velocities of K individuals, Z the partition of them into groups; y the detections. N_x
particles of X, N_z partitions under each. The steps of a frame, with the numbers of Algorithm 1:

    4  X' ~ pi(X' | X, y)              composite proposal                     before eq. 3   distributions
         alpha of N(A x, Sigma), the rest pi_det
    5  q = qbar p(X' | X, Z)           groups move individuals                eq. 5          group_proposal_kernels
         N(x + B g, Sigma) for each person, g the mean of the group
    6  resample Z by q                                                                       decentralised_filter
    7  Z' ~ pi(Z' | X', X, Z)          Merge, Split, None of each group       eqs 6, 7       group_proposal_kernels
    1  w = p_Nz(y | X') p_Nz(X' | X) / pi(X' | X, y)                          eq. 4          decentralised_filter
    3  qbar = p(y | X', Z')            exp(-lambda_cl d_cl), Davies-Bouldin   eq. 4          partition_labels_kernels
       estimate                        means, votes on labels                 Fig. 3         report
    2  resample X and Z by w                                                                 decentralised_filter

p_Nz(X' | X) is the normaliser of step 5. Steps 4 to 7 run when the new frame is there, as the proposal uses it.
pi(e | X, g, g') of step 7 is a multinomial logistic regression, learned from simulated truth by `flockscope fit joint`
(event_classifier.toml has its weights, command and scores).

Readings, where the paper is silent or contradicts itself:

- Label 0 is nobody's group: it is left out of eq. 5, and each person alone is a cluster.
- Eq. 4 contradicts its own assumption, by which it would be p(y | X). It is used as printed, as an energy.
- VAR1 has the constant velocity of eq. 3; cancelled literally, everybody would stand still.
- pi_det has the predicted velocity.
- Resampling is systematic, in each frame.
- d_cl is of whole states: 1 m/s counts as 1 m.
- In eq. 7 members are those of Z, and g' has the nearest mean place at the earlier time.
- f takes removed people out of their groups; a member who is left over is alone.
- |e| is n + n' after Merge, n after None, n / 2 after Split.
- In Fig. 3 a group is named by its least member; so people who are mostly together can be separated.
- The first partition of a person is drawn by the validity: the person is alone or joins the nearest group.
- Velocities at the start are those of a Kalman filter of the new person; those of DEEPER-JIGT.2 are of the last step.

Fitted, as the paper leaves it open: λ_cl on friends-meet, training seeds 0:2;
event_classifier.toml, which names scenes and seeds. Not fitted: N_x, N_z, Σ, λ_y, α.

Departures. A star marks those that stay in the preset `paper`:

- association*: one for all particles, of the largest probability; newcomers after people. Places are predicted by eq.
  3. Paper: given. Why: detections are anonymous.
- existence*: probabilities of shown, hidden and false, by a Markov chain in time and by measurements and misses
  (`detect_prob`, `hidden_time`). Paper: none. Why: any frame rate; misses and false alarms.
- births*: a free detection, followed by a Kalman filter, is a person from an existence of 0.9 on. Paper: not stated.
  Why: false alarms.
- losses*: unreported below an existence of 1/2; removed if hardly anything is there any more, person or false alarm.
  Paper: restarted from the truth. Why: no truth.
- frames without measurement*: X is predicted, nobody counts as missed, Z changes as ever. Paper: each frame is
  observed. Why: nobody could be seen.
- existence in the filter*: unreported people count fully in partitions, votes and events; for events they stay in
  their groups. Paper: all exist. Why: one state for all.
- p(y | x)*: normal about the place; 1 if missed. Paper: colour templates. Why: input is points.
- pixels*: each blob one detection (`pixel_noise`). Paper: boxes. Why: no detector.
- boxes*: reported in the image, with sizes that follow the measured ones. Paper: a template's box at the state. Why:
  they are shown and scored.
- proposal*: mixture for each person, the dynamics alone if missed. Paper: mixture of products. Why: people differ.
- π_det: product of dynamics and likelihood (`algorithm`). Paper: Σ about the detection. Why: more useful particles.
- Σ*: white acceleration and jitter, per root second. Paper: not printed. Why: any frame rate.
- weights: people resampled by their own part, partitions by the rest (`algorithm`). Paper: one for a particle. Why:
  many people, few particles.
- moments: by the own part (`algorithm`). Paper: by w. Why: as the weights.
- validity*: with prior scatter, virtual cluster and least distance. Paper: Davies-Bouldin. Why: undefined for one
  cluster or equal centres.
- λ_cl*: per second. Paper: each frame. Why: any frame rate.
- p(Z | X): by the beliefs of pairs, from the estimated states and groups of all tracked people, the same for all
  particles (`belief_rate`, `belief_memory`). Paper: by the validity, of each particle. Why: passing strangers look
  alike.
- eq. 5: for missed people alone, with the likeliest Z of the particle, in the proposal (`variant`). Paper: for all, in
  the weights. Why: people who are seen gain little by it, and the variance of the weights costs more.
- events*: also people alone; in random order, each changes once. Paper: groups, all at once. Why: people alone must
  merge.
- merges*: two groups that are each other's nearest draw it once. Paper: each group draws. Why: the classifier's
  probability is the pair's.
- probabilities*: hazards over 0.1 s. Paper: each frame. Why: any frame rate.
- features*: log(1 + symmetric d_KL) up to 8, shrunk covariances, d_v, root. Paper: d_KL, d_v, variance. Why: less
  noise.
- times of the features*: a step apart, learned 0.1 s apart. Paper: a frame for both. Why: one classifier for all frame
  rates.
- classifier*: learned also from wrong partitions, with errors of states. Paper: labelled scenarios. Why: the filter
  recovers.
- parts of a split*: two, drawn by their validity; of more than six people one alone, or cuts along the main axis.
  Paper: f is deterministic, its parts not stated. Why: not all are plausible.
- size prior: Merge only, relative to its peak (`algorithm`). Paper: all events. Why: it divides large groups.
- votes*: a person alone votes for the own name, as does the least member of a group. Paper: label 0 has votes of its
  own. Why: a group keeps its least member.
- weights of votes*: before step 2, by the rest, in the preset by w (`algorithm`). Paper: summed over i after step 2.
  Why: no noise of resampling.
- ids, onsets*: events of groups that change late, by the belief; ids as in the truth; onsets dated back, those of leave
  to the last measurement. Paper: none. Why: as the truth.
- events that correct groups*: not reported (`tracking.grouping.group_events`); nor are enters of the first
  second. Paper: none. Why: who was in one group by mistake neither met nor parts.
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
    moved,
    process_noise,
)
from tracking.papers.joint.division_kernels import place_newcomers
from tracking.papers.joint.people import Newcomers, People, associate
from tracking.papers.joint.report import OWN_EVENTS, ReportedEvents


class Joint(PointTracker):
    """The tracker `joint`: people and the groups they form, from points or from pixels.

    Made from a config; None: the defaults. State: config, which may be replaced between two frames; nested, the
    particles after step 2; people, the tracked people; newcomers, people who are not confirmed yet; groups, the people
    of each reported group, by id; events, which makes the events; belief, of pairs; streams, the random numbers; shown
    (K, 4), boxes of the people reported last, px, or None.
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
        return tracks

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
        self.events.add(id, mean[:, :2], seen)
        events = self.events.events(self.groups, self.unit)
        parts = [frozenset(id[rows].tolist()) for rows in self._groups()]
        self.groups = self.events.people.identities.name(frame.index, parts, self.groups)
        shown = self.people.existence >= REPORTED
        id, group, mean, cov = id[shown], report.known_groups(self.groups, id[shown]), mean[shown], cov[shown]
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
