"""One frame of `blob` from pixels: the cascade of Gonzalez et al. (2006) on blobs, and people who share a blob (ours).

Order of a frame, with the paper's sections:
    predict all tracks                                                        sec. 4.2, eqs 1, 2
    if a detector's boxes are given, too: associate, update, start tracks     ours (box_evidence)
    classify, clean, find blobs                                               secs. 3.2, 3.3 (detect.foreground)
    blobs of one person's size (without `split` all): gate, associate         secs. 4.3, 4.4, eqs 8 to 10
    other foreground: split among the tracks expected there, by templates     ours (person_template)
    foreground that no track explains, as large as a person: new tracks       ours (person_template)
    update with the ellipses                                                  sec. 4.2, eqs 3 to 7
    where a camera is known: update on the ground with their boxes            ours (tracked_people)
    axes return towards those of a person at the track's place                ours (tracked_people)
    looks: the colours of people, where nobody hides them, are learned        ours (person_look_kernels)
    by existence (ours) or rho: confirm, delete, start tracks                 secs. 4.5, 5 (tracked_people)
    adapt the background, except where confirmed tracks are                   ours
    learn the size of a person, and an unknown scale, from lone blobs         ours (detect.person_size)

A blob that is associated with no track may start one; without `split` no blob inside any gate does. At frame 367 of
Gonzalez et al. (2006, sec. 5) pieces "still lie within the gate" and "are assigned to the existing tracker"; the paper
does not say how. Here one of them is the measurement: the nearest one with "rho", else the most likely one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.types import Array, Bools, Context, Detections, Frame, Image, Ints
from tracking.detect.blobs import Blobs
from tracking.detect.foreground import Foreground, Segmented
from tracking.detect.person_size import KEPT, PersonSize, upright
from tracking.filters import kalman
from tracking.papers.blob import box_geometry, person_look_kernels, person_template, person_template_search_kernels
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob.box_evidence import BoxEvidence
from tracking.papers.blob.config import CONFIRM_GATE, BlobConfig
from tracking.papers.blob.ellipse_tracks import TrackedEllipses
from tracking.papers.blob.person_look_kernels import LEARN_SHOWN, LOOK_TIME
from tracking.papers.blob.tracked_people_kernels import covered_shares
from tracking.running import image_scale

SIZE_TIME = 0.5  # s between pictures from which sizes are learned once enough is remembered: it must be of many people
EVIDENCE = 10.0  # nats, log-likelihood of a template with full support; d^2 / 2 of its place is subtracted
TRACK_SUPPORT = 0.3  # least foreground share in the part of a confirmed track's template that no other covers
ENTRY_SUPPORT = 0.5  # least support of the template of a new person or of a tentative track
PERSON_NOISE = 0.15  # m, standard deviation of people's sizes about the size expected at their place
ANGLE_NOISE = np.radians(8.0) ** 2  # rad^2, variance of a measured direction beside that of the blob's moments
SHARED = 0.35  # share of a predicted box that a blob's box must cover for the track to be expected in the blob
UPRIGHT = 25.0  # deg, standard deviation of the direction of a person measured by an upright template
EXTENT = 0.75, 1.3  # least and largest height and width of a template relative to the expected person
BLIND = 25.0  # a template's variance of height and width relative to a lone blob's: they are predicted, not measured
LEAST_SHOWN = 0.2  # a person of whom a smaller share is visible is measured as if this share were


class Measured(NamedTuple):
    """Measurements of K tracks, one row each; tracks without a measurement have no row.

    rows (K,): table positions of the tracks, from 0, each once, in any order. z (K, 5): ellipse: centre x, y, full axes
    h, w (px), direction theta of h (rad). noise (K, 4): variances of x, y, h, w, m^2. angle_var (K,): variance of
    theta, rad^2, inf if it is not measured. support (K,), 0 to 1: foreground less half the background, of the pixels
    that the template alone covers, over its area; 1 for a blob.
    """

    rows: Ints
    z: Array
    noise: Array
    angle_var: Array
    support: Array

    def joined(self, more: Measured) -> Measured:
        """Returns new Measured with the rows of these measurements followed by those of `more`."""
        return Measured(*(np.concatenate(pair) for pair in zip(self, more, strict=True)))


class PixelUpdater:
    """Updates the tracks of `people` from the picture of each frame.

    State: foreground, the pipeline with its background model; size, the size of a person at each place. It learns from
    every picture until KEPT people are remembered, then from the first one at or after `learn_at`, s. people, the table
    of tracks; config; gates, confirm_gates (2,): largest squared Mahalanobis distance d^2, without and with direction,
    of an association and of a measurement that may confirm a track; boxes, the evidence of a detector; upright_var:
    variance of the direction of an upright template, rad^2, inf from straight above.
    """

    def __init__(self, config: BlobConfig, people: TrackedEllipses, context: Context) -> None:
        """Learns background and person size from the context's background sample, which must not be None
        (AssertionError)."""
        assert context.background is not None
        if not np.isnan(context.px_per_m):
            image_scale.required(context.px_per_m)
        self.people = people
        self.size, self.learn_at = PersonSize(context), 0.0
        self.foreground = Foreground(context, config)
        self.foreground.learn_person_size(self.size, context.background)
        self.boxes = BoxEvidence(people, self.size)
        self.upright_var = np.inf if self.size.above else np.radians(UPRIGHT) ** 2
        self.follow(config)

    def follow(self, config: BlobConfig) -> None:
        """Replaces the config, which `people` must follow already; background and person size stay as learned."""
        from scipy.special import chdtri

        self.config = config
        self.foreground.follow(config)
        self.boxes.calibrate()
        # largest d^2 at these shares, for 4 degrees of freedom (no direction) and 5 (eq. 10)
        self.gates = chdtri(np.array([4, 5]), 1 - config.gate)
        self.confirm_gates = chdtri(np.array([4, 5]), 1 - CONFIRM_GATE)

    def step(self, frame: Frame, detections: Detections | None) -> None:
        """Updates the tracks with a frame's picture (H, W, 3) BGR uint8 and with its boxes; each may be missing."""
        people, foreground = self.people, self.foreground
        people.px_per_m = foreground.scale
        seen = None if frame.image is None else foreground.segment(frame.image)
        looked = seen is not None and seen.plausible
        step = foreground.take_step()
        if step is not None:
            people.carry(step)
        people.predict(observed=looked)
        people.widen_view(np.zeros((0, 4)))
        boxed = np.zeros(0, np.int64)
        if detections is not None:
            there = seen.image if seen is not None and looked else None
            boxed = self.boxes.measure(frame.t, foreground.on_model(detections), there, self.gates[0])
            people.expect(looked * self.config.detect_prob)
        if seen is None or not seen.plausible:
            if seen is not None:
                foreground.adapt(seen, self._protected())
            people.record_measured(np.zeros(0, np.int64), np.zeros(0, bool), np.zeros(0), np.zeros(0))
            people.measured[boxed] = True
            people.delete_tracks(frame.t)
            return
        found = foreground.person_blobs(seen.mask)
        self._measure(frame.t, seen, found, boxed)
        foreground.adapt(seen, self._protected())
        if len(found) and (frame.t >= self.learn_at or len(self.size.lone) < KEPT):
            self.learn_at = frame.t + SIZE_TIME
            self.size.learn(found.box, found.ellipse, self._lone_people(found, people.upright_boxes()))
            foreground.take_scale(self.size)

    def _protected(self) -> Bools:
        boxes = self._person_boxes(self.people.upright_boxes()[self.people.confirmed])
        return person_template.template_mask(self.foreground.shape, box_geometry.standing(boxes))

    @property
    def camera_moves(self) -> bool:
        """True if the camera was found to move."""
        return self.foreground.stabiliser is not None

    def reported_boxes(self, rows: Ints) -> Array:
        """Returns the boxes (K, 4) that the tracker reports for the tracks at positions `rows` (K,): centre x, y,
        height, width, px."""
        boxes = self._person_boxes(self.people.upright_boxes()[rows])
        return np.concatenate([boxes[:, :2], boxes[:, 2:] * np.sqrt(self.boxes.over_person)], 1)

    def _measure(self, t: float, seen: Segmented, found: Blobs, boxed: Ints) -> None:
        people = self.people
        expected = people.upright_boxes()
        split = self.config.split and self.size.reliable
        lone = self._lone_people(found, expected) if split else np.ones(len(found), bool)
        columns = lone.nonzero()[0]
        z, angle_var = found.ellipse[columns], found.angle_var[columns] + ANGLE_NOISE
        made, taken, gated = self._associate(z, angle_var)
        if len(boxed):
            self.boxes.learn(made.rows, self._person_boxes(upright(made.z[:, :4], made.z[:, 4])))
        unexplained = np.delete(z, taken if split else gated, 0)
        if split:
            cover = np.zeros(seen.mask.shape, np.int16)
            for k in columns.tolist():
                part = found.window(k)
                cover[part][found.label[part] == k + 1] = kernels.EXPLAINED
            for confirmed in (True, False):
                made = made.joined(self._measure_by_templates(seen, cover, expected, made.rows, confirmed))
            entered = person_template.find_new_people(seen.mask, cover, self.size, ENTRY_SUPPORT)
            unexplained = np.concatenate([unexplained, self._person_ellipses(box_geometry.centred(entered))])
        d2, log_det = people.directed_innovations(made.z, made.angle_var)
        each = np.arange(len(made.rows))
        evidence = people.evidence(made.rows, d2[made.rows, each], log_det[made.rows, each])
        away = people.update(made.rows, made.z, made.noise, made.angle_var)
        boxes = self._person_boxes(upright(made.z[:, :4], made.z[:, 4]))
        people.measure_on_ground(made.rows, boxes, made.noise)
        if split:
            self._relax_sizes()
            self._learn_looks(seen.image, made.rows)
        near = away <= self.confirm_gates[kalman.directed(made.angle_var).astype(int)]
        people.record_measured(made.rows, near, made.support, evidence)
        people.measured[boxed] = True
        person = people.new_people(unexplained[:, :4].copy(), np.ones(len(unexplained), bool))
        people.delete_tracks(t)
        people.start_tracks(unexplained, np.ones(len(unexplained)), t, person)

    def _relax_sizes(self) -> None:
        at = box_geometry.standing(self.people.upright_boxes())
        axes = self.size.axes(at[:, :2])
        rows = np.flatnonzero(np.isfinite(axes).all(1))
        self.people.relax_axes(rows, -np.sort(-axes[rows]), PERSON_NOISE**2)

    def _learn_looks(self, image: Image, rows: Ints) -> None:
        people = self.people
        at = box_geometry.standing(self._person_boxes(people.upright_boxes()))
        gain = -np.expm1(-people.dynamics.dt / LOOK_TIME)
        shares = kernels.visible_share(np.zeros(image.shape[:2], np.int16), at)
        person_look_kernels.learn(image, at, people.look, rows[shares[rows] >= LEARN_SHOWN], gain)

    def _lone_people(self, found: Blobs, expected: Array) -> Bools:
        one = not self.size.reliable or self.size.one_person(found.box, found.ellipse)
        sure, blobs = expected[self.people.confirmed], box_geometry.centred_from_ltwh(found.box)
        several = (covered_shares(sure, blobs) >= SHARED).sum(0) > 1
        return np.asarray(one & ~found.cut() & ~several)

    def _person_boxes(self, upright: Array) -> Array:
        return np.concatenate([upright[:, :2], upright[:, 2:] * self.size.box_over_ellipse], 1)

    def _person_ellipses(self, box: Array) -> Array:
        return box_geometry.inscribed_ellipses(np.concatenate([box[:, :2], box[:, 2:] / self.size.box_over_ellipse], 1))

    def _associate(self, z: Array, angle_var: Array) -> tuple[Measured, Ints, Ints]:
        """Returns the measurements by ellipses z (M, 5), the rows of z associated, and those in any gate."""
        gated_var = np.full(len(z), np.inf) if self.size.above else angle_var
        d2, log_det = self.people.directed_innovations(z, gated_var)
        near = d2 <= self.gates[kalman.directed(gated_var).astype(int)]
        rows, gated = map(np.ascontiguousarray, np.nonzero(near))  # else one pair is another type to numba
        d2, log_det = d2[rows, gated], log_det[rows, gated]
        best = self.people.associate(rows, gated, d2, self.people.evidence(rows, d2, log_det))
        rows, taken = rows[best], gated[best]
        noise = np.tile(self.people.noise, (len(rows), 1))
        return Measured(rows, z[taken], noise, angle_var[taken], np.ones(len(rows))), taken, gated

    def _measure_by_templates(
        self, seen: Segmented, cover: kernels.Cover, expected: Array, rows: Ints, confirmed: bool
    ) -> Measured:
        people = self.people
        unmeasured = people.confirmed == confirmed
        unmeasured[rows] = False
        open_rows = np.flatnonzero(unmeasured)
        at = box_geometry.standing(self._person_boxes(expected[open_rows]))
        size = self.size.at(at[:, :2])
        size = np.where(np.isfinite(size), size, at[:, 2:])
        at[:, 2:] = np.clip(at[:, 2:], EXTENT[0] * size, EXTENT[1] * size)
        var = (people.bank[kalman.VAR, open_rows] + people.noise)[:, :2]
        spread = np.sqrt(var) * people.scale[open_rows, None]
        looks = people.look[open_rows if confirmed else []]
        at = person_template_search_kernels.fit_places(seen.mask, cover, at, spread, EVIDENCE, seen.image, looks)
        least = TRACK_SUPPORT if confirmed else ENTRY_SUPPORT
        keep = np.flatnonzero(kernels.prune(seen.mask, cover, at, least, confirmed))
        at = at[keep]
        support, visible = kernels.supports(seen.mask, cover, at, 1), kernels.visible_share(cover, at)
        noise = people.noise / np.maximum(visible, LEAST_SHOWN)[:, None] ** 2
        noise[:, 2:] *= BLIND
        ellipses = self._person_ellipses(box_geometry.centred(at))
        angle_var = np.full(len(at), self.upright_var)
        return Measured(open_rows[keep], ellipses, noise, angle_var, np.clip(support, 0.0, 1.0))
