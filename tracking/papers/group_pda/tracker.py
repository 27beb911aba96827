"""`group-pda`: groups of people tracked as wholes, from points or from foreground pixels.

Gennari & Hager, "Probabilistic data association methods in visual tracking of groups", CVPR 2004. The state of a group,
or of each part of one, is (xi, v, Sigma, N): centroid xi and velocity v, together x with covariance P; extent Sigma of
the members' positions; number of people N. Members are at y_i = xi + s_i, s_i normal with Sigma (eq. 2.1). The steps of
a frame (Fig. 1), with their equation (eq.) or section (sec.) and the module:

    (F, Q: transition and process noise of x; S: covariance of a point about xi, in the paper Sigma; y: a point; gamma:
    squared Mahalanobis radius `gate`; m_d, m_N, m_g: masses by the centroid's place, the number of people and the group
    constraint)

    predict    x = F x, P = F P F' + Q                                 eq. 2.3            group_bank
    gate       {y : (y - xi)' S^-1 (y - xi) < gamma}                   eq. 2.2            association
    associate  theta_j: unshared points and the j nearest shared ones  sec. 4.1           association_kernels
    masses     m_tot = m_d m_N m_g: m_d, m_N                           eq. 4.2            association_mass_kernels
               m_g = 1 if |G_y| = 1 (feasible), else 0                 eq. 4.1            filters.components_kernels
    update     x, P, Sigma, N as means over the associations           eq. 2.4, sec. 4.3  association_kernels
    split      a group whose associations all have m_g = 0             sec. 3.3, 4.2      merging_and_splitting
    merge      R_x: overlapping regions and like velocities            sec. 3.1           merging_and_splitting
               x, Sigma, N of the union, means weighted by N           sec. 3.2, eq. 3.1  merging_and_splitting
    birth      unclaimed points, grouped by G_y                        sec. 3.3           births_and_losses

The grouping functions G_0, G_x, G_y of points (sec. 3.1, 3.3, 4.2.1) are in tracking.filters.components: G_y links
points at most 2 x `radius` apart, and joins linked sets whose regions overlap. A group or part without points for
`coast_time` is lost; a group leaves with its last part. `association = "none"` is section 5.2.1: a group takes all
points in its region, whether they are one group or not, and does not fall apart. With `corrections` it may be hidden.

Departures. Those marked (c) are off with `corrections` off.

- units: m and s, in an image by one scale. Paper: px and frames. Why: any camera and frame rate.
- F, Q: constant velocity, white acceleration that is constant in a frame. Paper: not stated. Why: any frame rate.
- search region of the gate, and distances that order shared points: by Σ, P and a point's variance. Paper: Σ, as in
  merges here. Why: few points give a small Σ.
- extents: with 1/N, shrunk by `spread_weight` to a prior, `person_spread`; (c) corrected for the gate. Paper: sample
  covariance. Why: few people; with 1/N eq. 3.1 is exact.
- G_x in G_y: repeated until nothing changes. Paper: applied once. Why: joined regions overlap others.
- noise, (c): from pixels, components below 0.25 people do not count in G_y. Paper: all count. Why: specks of
  foreground.
- births: confirmed after `confirm_time`, merged from the next frame on, removed after as long without points; until
  confirmed no points of a confirmed group. Paper: at once. Why: false alarms.
- P: Σ w² P of merged groups; new ones r² (1 + 1/N) and 1.3 m/s per axis. Paper: none. Why: filter and SR_v need one.
- R, (c): members keep places, some are missed, stand-ins repeat their errors. Paper: a member's place and noise, read
  as Σ / m, of m people. Why: less noise.
- m_d: covariance H P H' + R, with the R of each association's m. Paper: one P_yc. Why: fewer people measure a centroid
  worse.
- m_N: σ_n grows with N, by 1 %; heavy tails. Paper: normal, σ_n. Why: several join at once.
- α_s and α_N: equal, from `extent_time`. Paper: two constants. Why: one parameter less.
- missed detections: from points, missed members who were seen twice stand in for `carry_time` while the group has
  points, and their places stay the group's for `coast_time`. Paper: not considered. Why: detectors miss people.
- stand-ins: associations of stand-ins alone leave x and P as they are, and are no infeasible time. Paper: none. Why:
  their places come from x.
- Σ and N: rest until infeasible time is counted back. Paper: always updated. Why: they would swell.
- no points: coasts, lost after `coast_time`. Paper: null masses, as before a split. Why: occlusion.
- frames that nobody observed: predicted only. The next observed frame stands for the time since the last, but for no
  more than that one did; of the rest the share `coast_time` / 15 s counts as without points. Paper: none. Why: gaps
  are no evidence, and who is in view leaves after 15 s on average.
- an association without points: has no mass. Paper: j = 0 may be empty. Why: it has no centroid.
- hidden feet: with boxes and a camera not overhead, points whose feet another box may hide are put no further than
  below heads at 1.5 m. Paper: points as they are. Why: hidden feet displace points.
- pixels: foreground of tracking.detect on a grid of 0.1 m, each a share of a person, put where on the ground that
  person's middle is: the runs along the images of upright lines are cut into people from the feet upwards, as who is in
  front hides the others; a run shorter than a person is continued to that height into the runs that it then reaches.
  The background rests where groups are. Paper: all of an unnamed background subtraction, each counts one, in px. Why: N
  in people; speed; near and far people are alike, and who stands behind is apart.
- too much foreground: predicted only, if the background adapts. Paper: none. Why: the light has changed.
- colours: in the mass, order and division of shared points (`appearance`), from pixels; learned from unshared points,
  over `extent_time`. Paper: future work. Why: similar groups cross.
- places, (c): in the same, from points, too: where members have walked since none of the group's points could be
  another's. Paper: none. Why: groups that meet keep their people.
- split: after `split_time`, until then predicted only; measured frames count back; colours and age go along. Paper:
  after consecutive infeasible frames (Fig. 1: at once). Why: misses.
- parts, (c): what falls apart is tracked as parts with a state each, but stays one group, their union (eq. 3.1), until
  some have been more than 1.5 m from the rest for `confirm_time`; a part that is not measured, or infeasible, holds the
  others; R_x joins parts again. Paper: new groups at once. Why: misses and sway take people apart for a moment.
- split into one part or none: the group stays as it is. Paper: initialised anew. Why: others' points made it
  infeasible.
- points of a split, and members' places: those most probably the group's, with stand-ins. Paper: all in the region.
  Why: others' people stay out.
- ids: the part that was largest when the group fell apart keeps the id, after its loss the largest left; of merged
  groups the largest, then the oldest. Paper: none. Why: tracks need ids.
- walking out: a new group within reach of a member (2 m/s and 3 r) is a part of its group and as old; without
  corrections it splits off once confirmed. Paper: a new group. Why: splits without shared points.
- like velocities, (c): evidence from their difference, on the mean of two steps, against `merge_velocity`; from points
  of the members seen in both of two frames, stand-ins as predicted; of a group in parts, those of the part with its id.
  Paper: SR_v overlap. Why: P does not measure likeness; people sway with each step; hidden members move the centroid.
- SR_v, without corrections: of the updated velocity, with the gate's γ. Paper: of the predicted one; its size is not
  stated. Why: Fig. 1 merges after the update.
- near groups, (c): people more than 1.5 m apart are evidence against one group, too. Paper: regions overlap. Why: no
  merge after a split.
- merge: of confirmed, feasible groups whose part with the id is measured; their measured parts become one state; (c)
  once the evidence of the last 5 s is `merge_time`; gaps up to `coast_time` count. Paper: at once. Why: crossing
  groups.
- no event: a merge if at most one of the groups was there 2 s before the onset, and a split if the group was not; an
  enter in the first second; an enter or leave of one person. Paper: none. Why: they came together, were never one
  group, were there before, or are none.
- hidden, (c): a group or part whose points are all more probably others' keeps x and P as predicted, and coasts. Paper:
  groups share points. Why: hidden groups follow others.
- reports: parts that had points within `report_coast`, with hulls of members' places. Paper: every group, with its
  search region. Why: lost groups are guesses.
- onsets: a merge, (c), to when its evidence was least, else this frame; a split to when the last two parts would have
  been 1.5 m apart, had they moved straight, as fast as when it is decided, at least 0.7 m/s; enter and leave to the
  first and last points, a leave later by the unobserved time that is no evidence. Paper: none. Why: decisions lag.
- depth of points in an image: divided by the sine of the tilt in what merges, splits and onsets take in m. Paper: px.
  Why: oblique views.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np

from sim.arrays import no_ids
from sim.geometry.hull_kernels import convex_hulls
from sim.geometry.polygons import FOOTPRINT
from sim.types import Array, Bools, Context, Detections, Frame, Groups, Ints, Plane, Tracks
from tracking.filters.existence import LIFETIME
from tracking.grouping.whole_groups import GroupIds, WholeGroupEvent, whole_group_tracks
from tracking.papers.group_pda.association import (
    PointClaims,
    associate,
    below_heads,
    claimed,
    gated_distances,
    log_ratio,
    place_density,
    remember,
    search_regions,
    with_missed_members,
)
from tracking.papers.group_pda.births_and_losses import add_newborns, confirm, expected_members, remove_lost
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.from_pixels import (
    ForegroundPoints,
    colour_bins,
    colour_density,
    sine_tilt,
    update_histograms,
)
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.merging_and_splitting import GroupChanges, fall_apart, whole_groups
from tracking.papers.group_pda.scaled_parameters import ScaledParameters, scale_parameters
from tracking.running.image_scale import required

SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


class GroupPda:
    """The tracker `group-pda`: groups of people tracked as wholes, from points or from foreground pixels.

    State: config, which may be replaced between two frames; bank, the groups; ids, which gives the next id; changes,
    the past of pairs that may merge or split; pixels: grid points and background model, None from points; plane:
    "ground" or "image"; context; begin: time of the first observed frame, inf before; interval, last_interval: frames
    since the last observed frame, and from the one before to it. All but config exist after `reset` only.
    """

    needs: ClassVar[tuple[str, ...]] = ("pixels", "points", "boxes")
    config_class: ClassVar[type[GroupPdaConfig]] = GroupPdaConfig

    def __init__(self, config: GroupPdaConfig | None = None) -> None:
        self.config = config or GroupPdaConfig()

    def reset(self, context: Context, seed: int) -> None:
        """Forgets everything and starts a sequence. With a background sample in the context pixels are tracked, else
        points.

        `seed` has no effect: nothing is random. Until the first detections `plane` is "image" from pixels, or with a
        scale but no camera, else "ground". If pixels are tracked, raises InputError if the scale px_per_m is zero or
        negative, or neither known nor learned from the sample, or if the sample has a wrong shape or dtype, too few
        frames or shows no background.
        """
        self.context = context
        self.bank, self.ids = GroupBank.empty(), GroupIds()
        self.changes = GroupChanges()
        self.pixels = None if context.background is None else ForegroundPoints(self.config, context)
        if self.pixels is not None:
            self.context = context.replace(px_per_m=self.pixels.scale)
        self.begin, self.interval, self.last_interval = np.inf, 0, 1
        flat = context.camera is None and context.px_per_m > 0
        self.plane: Plane = "image" if flat or self.pixels is not None else "ground"
        self.colours = np.zeros(0, np.int64)
        self.usual_box: Array | None = None

    @property
    def px_per_m(self) -> float:
        """Scale of the image in px per metre: the context's, or, from pixels, learned from its background sample; nan
        if unknown."""
        return self.context.px_per_m

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """Returns the groups and events of the frame, as Tracks with unit "group"; updates all groups.

        Order: predict; remove lost groups; gate, associate, update, fall apart (Fig. 1), births; split, merge; confirm.
        From points `detections.pos` is used (x, y), from pixels `frame.image`. A frame without them (None), and from
        pixels one with too much foreground, is predicted only; before the first detections the Tracks are empty. A
        config that has replaced `config` since the last frame holds from this frame on; the groups stay.

        Raises InputError if points are in the image and the context has no scale above 0, or if the picture's size or
        dtype is not the background sample's.
        """
        if self.pixels is not None and self.pixels.config is not self.config:
            self.pixels.follow(self.config)
        points, weights = self._points(frame, detections)
        if len(self.bank):
            self.bank.predict(self._scaled_parameters(1))
        self.interval += 1
        events = [] if points is None else list(self._look(points, weights, frame.t))
        return self._report(frame, events, self._about(detections))

    def _report(self, frame: Frame, events: list[WholeGroupEvent], outline: Array) -> Tracks:
        """Returns the confirmed groups that had points within the last `report_coast` s, by id.

        outline (V, 2): a polygon round the origin, in the plane's unit, that stands for what covers the ground or the
        image about one member's place: a footprint or a usual box; without effect from pixels."""
        t = frame.t - self._no_evidence(self.interval)
        seen = self.bank.confirmed & (t - self.bank.last_seen <= self.config.report_coast + 1e-9)
        bank = whole_groups(self.bank, np.flatnonzero(seen))
        rows = np.argsort(bank.id)
        hulls = convex_hulls(self._outlines(bank, rows, outline))
        x, P, extent = bank.x[rows], bank.P[rows], bank.extent[rows]
        if self.pixels is not None:
            view = self.pixels.view
            J = view.jacobian(x[:, :2])
            both = np.kron(np.eye(2), J)
            P, extent = both @ P @ np.swapaxes(both, 1, 2), J @ extent @ np.swapaxes(J, 1, 2)
            x = np.hstack([view.image(x[:, :2]), np.einsum("gij,gj->gi", J, x[:, 2:])])
            events = [replace(e, pos=tuple(view.image(np.array([e.pos]))[0].tolist())) for e in events]
        groups = Groups(bank.id[rows], (no_ids(),) * len(rows), x[:, :2], x[:, 2:], extent, bank.size[rows], hulls)
        return whole_group_tracks(frame, self.plane, self.context.fps, groups, P, events)

    def _points(self, frame: Frame, detections: Detections | None) -> tuple[Array | None, Array]:
        if self.pixels is not None:
            found = None if frame.image is None else self.pixels.points(frame.image, self.outlines())
            if found is None or frame.image is None:
                return None, np.zeros(0)
            pixels, points, weights = found
            if self.config.appearance > 0:
                self.colours = colour_bins(frame.image, pixels)
            return points, weights
        if detections is None:
            return None, np.zeros(0)
        self.plane = "image" if detections.plane == "image" else "ground"
        points, camera = np.array(detections.pos[:, :2]), self.context.camera
        if self.plane == "ground" and detections.box is not None and camera is not None and camera.kind != "top":
            points = below_heads(points, detections.box, camera)
        return points, np.ones(len(points))

    def _outlines(self, bank: GroupBank, rows: Ints, about: Array) -> list[Array]:
        # The places on their own hull suffice, and are few.
        corners = convex_hulls([bank.positions(r) for r in rows.tolist()])
        if self.pixels is not None:
            return [self.pixels.outline(c) for c in corners]
        return [(c[:, None] + about).reshape(-1, 2) for c in corners]

    def _about(self, detections: Detections | None) -> Array:
        if self.plane == "ground":
            return FOOTPRINT
        if detections is not None and detections.box is not None and len(detections.box):
            self.usual_box = np.median(detections.box[:, 2:], 0)
        return FOOTPRINT * self.context.px_per_m if self.usual_box is None else SQUARE * self.usual_box / 2

    def outlines(self) -> list[Array]:
        """Returns points (V, 2) u, v in px round the places of each confirmed group: corners of columns a person high.

        From points they are the corners of footprints or usual boxes, in the unit of the points.
        """
        return self._outlines(self.bank, np.flatnonzero(self.bank.confirmed), self._about(None))

    def _scaled_parameters(self, frames: int) -> ScaledParameters:
        fps = self.context.fps / frames
        if self.pixels is not None or self.plane == "ground":
            return scale_parameters(self.config, fps, 1.0, pixels=self.pixels is not None)
        return scale_parameters(self.config, fps, required(self.context.px_per_m), sine_tilt(self.context.camera))

    def _look(self, points: Array, weights: Array, t: float) -> Iterator[WholeGroupEvent]:
        """Updates all groups by the points of a frame that was observed, and yields the events.

        The frame stands for the frames since the one observed before, but for no more than that one did."""
        self.begin = min(self.begin, t)
        frames = min(self.interval, self.last_interval)
        self.bank.last_seen += self._no_evidence(self.interval - frames)
        self.interval, self.last_interval = 0, self.interval
        scaled = self._scaled_parameters(frames)
        if self.bank.colour_hist.shape[1] != scaled.colour_bins:
            self.bank.colour_hist = np.zeros((len(self.bank), scaled.colour_bins))
        yield from remove_lost(self.bank, scaled, t)
        self._measure(points, weights, scaled, t)
        yield from self.changes.step(self.bank, scaled, t)
        yield from confirm(self.bank, scaled, t, self.ids, self.begin)

    def _no_evidence(self, frames: int) -> float:
        """Returns the time, s, of so many unobserved frames, less its share in which people leave unseen."""
        return frames / self.context.fps * (1 - self.config.coast_time / LIFETIME)

    def _measure(self, points: Array, weights: Array, scaled: ScaledParameters, t: float) -> None:
        bank, predicted = self.bank, self.bank.x[:, :2].copy()
        region = search_regions(bank, scaled)
        d2 = gated_distances(bank, points, region, scaled)
        claims = with_missed_members(claimed(points, weights, d2, t), bank, scaled, t)
        expected = expected_members(bank, scaled, t)
        ratio, shared = np.zeros(claims.d2.shape), np.flatnonzero(claims.claimants > 1)
        may = np.isfinite(claims.d2[:, shared])
        if self.config.corrections:
            ratio[:, shared] += log_ratio(place_density(bank, claims.points[shared], may, scaled, t), may)
        if scaled.colour_bins:
            ratio[:, shared] += self.config.appearance * log_ratio(colour_density(bank, self.colours[shared]), may)
        mine = associate(bank, claims, region, ratio, scaled, t)
        remember(bank, claims, mine, predicted, scaled, t)
        if scaled.colour_bins:
            update_histograms(bank, mine, claims.claimants, self.colours, claims.weights, scaled)
        self._split(claims, mine, scaled, t)
        free = claims.claimants[: len(points)] == 0
        add_newborns(bank, points[free], weights[free], expected, scaled, t)

    def _split(self, claims: PointClaims, mine: Bools, scaled: ScaledParameters, t: float) -> None:
        bank = self.bank
        due = np.flatnonzero((bank.null_time >= self.config.split_time - 1e-9) & (bank.null_time > 0))
        for row in due.tolist()[::-1]:  # from the last row on, as parts are appended
            fall_apart(bank, row, claims.points[mine[row]], claims.weights[mine[row]], scaled, t, self.ids)
