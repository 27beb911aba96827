"""What a detector's boxes tell of the tracks of `blob` that are followed in pictures (ours).

Boxes are used before the picture of the same frame: the place after them is where templates and blobs are expected, so
that one density of a track's place has all evidence. A box is associated by

    N(z; z_pred, S) * exp(LOOK_EVIDENCE * fit) / density of false boxes

fit: how well the colours under the box fit the track's look (person_look_kernels). A box is two people's if the box
round two tracks that touch explains it better than each track alone; then it measures neither of them.

Boxes and silhouettes differ. Where a lone blob and a box measure one track, their difference is remembered: the medians
are the offset of boxes and their size relative to a person's. The spread raises the noise of boxes. Existence has both
sensors: see `existence.update_by_detector`.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Detections, Image, Ints
from tracking.detect.person_size import ENOUGH, KEPT, PersonSize
from tracking.filters import existence, kalman, kalman_kernels
from tracking.filters.existence import ScoreCalibration
from tracking.papers.blob import box_evidence_kernels as kernels
from tracking.papers.blob import box_geometry, person_look_kernels
from tracking.papers.blob.ellipse_tracks import TrackedEllipses
from tracking.papers.blob.person_template_search_kernels import LOOK_EVIDENCE
from tracking.papers.blob.tracked_people import LEAST_EXISTENCE, SIZE_SPREAD
from tracking.papers.blob.tracked_people_kernels import LIKELY
from tracking.papers.blob.update_from_boxes import measured_boxes

BOX_NOISE = 2.0  # variance of a box over the config's: errors of a detector last, so that boxes are not independent
SHARED_BOX = 0.1  # probability that two people whose boxes touch have one box together
PERSON_SPREAD = 0.15  # m: standard deviation of people's sizes about the size expected at their place
NORMAL_MEDIAN = 0.4549  # median of the square of a standard normal variable


class BoxEvidence:
    """Updates the tracks of `people` from the boxes of each frame.

    State: people, the table of tracks; size, the size of a person at each place; scores, the calibration of scores;
    pairs (K, 8), m: the last boxes and silhouettes of people who were measured by both, centre x, y, height, width of
    either, at most KEPT; offset (2,), m: of the centre of a box from the silhouette's; over_person (2,): height and
    width of a box over the silhouette's; noise (4,), m^2: variances of a box's centre, height and width; rows (K,), box
    (K, 4): the tracks that the last boxes measured, and these boxes.
    """

    def __init__(self, people: TrackedEllipses, size: PersonSize) -> None:
        self.people, self.size, self.scores = people, size, ScoreCalibration()
        self.pairs, self.rows, self.box = np.zeros((0, 8)), np.zeros(0, np.int64), np.zeros((0, 4))
        self.calibrate()

    def measure(self, t: float, detections: Detections, image: Image | None, gate: float) -> Ints:
        """Updates the tracks with the boxes of a frame at time t, s, and starts tracks for boxes that no track has.

        Returns the table positions (K,) of the tracks that were measured or started. image (H, W, 3) BGR: None if the
        frame has no picture. gate: largest squared Mahalanobis distance of an association.
        """
        people = self.people
        raw, score = measured_boxes(detections)
        box = self.as_seen(raw)
        people.expect(people.config.detect_prob)
        z = box_geometry.inscribed_ellipses(np.concatenate([box[:, :2], box[:, 2:] / self.size.box_over_ellipse], 1))
        ratio, free = self.scores.ratios(score), np.ones(len(z), bool)
        rows, columns, evidence = self._associate(box, z, ratio, free, image, gate)
        people.update(rows, z[columns], np.tile(self.noise, (len(rows), 1)), np.full(len(rows), np.inf))
        people.measure_on_ground(rows, box[columns], self.noise)
        if people.by_existence:
            seen = (people.states, people.detector, people.lasting, people.standing)
            existence.update_by_detector(*seen, rows, people.detectable, np.exp(evidence), ratio[columns])
        people.measured[:] = False
        people.measured[rows] = True
        at = np.ascontiguousarray(z[:, :4])
        person = people.new_people(at, free, ratio * self.size_ratios(box), last=False)
        person[columns] = people.existence()[rows]
        self.scores.add(score, person)
        free &= (person >= LEAST_EXISTENCE) | (not people.by_existence)
        self.rows, self.box, first = rows, raw[columns], len(people.id)
        people.start_tracks(z[free], score[free], t, person[free], boxed=True)
        if people.by_existence:
            people.confirmed[:] = people.existence() >= LIKELY
        return np.concatenate([rows, np.arange(first, len(people.id))])

    def learn(self, rows: Ints, silhouette: Array) -> None:
        """Learns offset, size and noise of boxes from tracks `rows` (K,) whose lone blobs have the boxes `silhouette`
        (K, 4), px, in the frame of the last `measure`."""
        _, mine, theirs = np.intersect1d(self.rows, rows, assume_unique=True, return_indices=True)
        if len(mine):
            scale = self.people.scale[self.rows[mine], None]
            new = np.concatenate([self.box[mine], silhouette[theirs]], 1) / scale
            self.pairs = np.concatenate([self.pairs, new])[-KEPT:]
            self.calibrate()

    def calibrate(self) -> None:
        """Computes offset, size and noise of boxes from the pairs; ENOUGH pairs without a difference count, too."""
        box, silhouette, noise = self.pairs[:, :4], self.pairs[:, 4:], self.people.noise * BOX_NOISE
        away = box[:, :2] - silhouette[:, :2]
        self.offset = np.median(np.concatenate([away, np.zeros((ENOUGH, 2))]), 0)
        self.over_person = np.median(np.concatenate([box[:, 2:] / silhouette[:, 2:], np.ones((ENOUGH, 2))]), 0)
        off = np.concatenate([away - self.offset, box[:, 2:] / self.over_person - silhouette[:, 2:]], 1)
        usual = np.tile(noise * NORMAL_MEDIAN, (ENOUGH, 1))
        spread = np.median(np.concatenate([np.square(off), usual]), 0) / NORMAL_MEDIAN
        # lone people are measured better than others: they may raise the noise only
        self.noise = np.maximum(noise, spread)

    def as_seen(self, box: Array) -> Array:
        """Returns the boxes (M, 4) that the people in a detector's boxes (M, 4), px, have in the picture."""
        place = box[:, :2] - self.offset * self.people.scale_of(box)[:, None]
        return np.concatenate([place, box[:, 2:] / self.over_person], 1)

    def _associate(
        self, box: Array, z: Array, ratio: Array, free: Array, image: Image | None, gate: float
    ) -> tuple[Ints, Ints, Array]:
        """Returns the tracks and boxes (K,) that are associated, and the log-likelihood ratios; boxes of tracks are no
        longer `free` (M,), which is changed in place."""
        people = self.people
        d2, log_det = people.innovations(np.ascontiguousarray(z[:, :4]), self.noise)
        rows, columns = map(np.ascontiguousarray, np.nonzero(d2 <= gate))  # else one pair is another type to numba
        d2 = d2[rows, columns]
        evidence = people.evidence(rows, d2, log_det[rows])
        pairs, shared = self.shared_boxes(box, columns, evidence)
        people.detectable[pairs.ravel()], free[shared] = 0.0, False
        if image is not None:
            fits = person_look_kernels.pair_fits(image, box_geometry.standing(box), people.look, rows, columns)
            evidence += LOOK_EVIDENCE * fits
        kept = free[columns]
        rows, columns, d2, evidence = rows[kept], columns[kept], d2[kept], evidence[kept]
        person, shown = people.existence(), people.seen_by_detector()
        states = np.stack([shown, person - shown, 1 - person])
        best = people.associate(rows, columns, d2, evidence, ratio[columns], states)
        free[columns[best] if people.by_existence else columns] = False
        return rows[best], columns[best], evidence[best]

    def shared_boxes(self, box: Array, columns: Ints, evidence: Array) -> tuple[Ints, Ints]:
        """Returns the pairs (P, 2) of tracks that have one box together, and the positions (P,) of these boxes.

        box (M, 4): as seen. columns, evidence (Q,): boxes of the gated pairs of a track and a box, and the
        log-likelihood ratio of each.
        """
        people = self.people
        mine = people.upright_boxes()
        mine = np.concatenate([mine[:, :2], mine[:, 2:] * self.size.box_over_ellipse], 1)
        pairs = kernels.pairs_beside(mine, people.existence(), LIKELY)
        if not len(pairs) or not len(box):
            return np.zeros((0, 2), np.int64), np.zeros(0, np.int64)
        scale = people.scale[pairs].mean(1)
        S = people.bank[kalman.VAR][pairs].mean(1) + self.noise
        d2, log_det = kalman_kernels.distances(kernels.joint_boxes(mine, pairs), S, box, scale)
        together = people.evidence(pairs[:, 0], d2.T, log_det) + np.log(SHARED_BOX)
        alone = np.zeros(len(box))  # a false box
        np.maximum.at(alone, columns, evidence)
        best = together.argmax(1)
        shared = np.flatnonzero(together[np.arange(len(box)), best] > alone)
        return pairs[best[shared]], shared

    def size_ratios(self, box: Array) -> Array:
        """Returns the likelihood ratio (M,) of the sizes of boxes (M, 4), as seen: a person's to a false box's. It is 1
        where the size of a person is not known."""
        known = self.size.at(box_geometry.standing(box)[:, :2])
        off = np.square((box[:, 2:] - known) / self.people.scale_of(box)[:, None])
        person = self.noise[2:] + PERSON_SPREAD**2
        other = person + SIZE_SPREAD**2
        ratio = np.exp((off * (1 / other - 1 / person) + np.log(other / person)).sum(1) / 2)
        return np.where(np.isfinite(ratio) & self.size.reliable, ratio, 1.0)
