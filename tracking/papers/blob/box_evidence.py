"""What a detector's boxes tell of the tracks of `blob` beside the picture (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Detections, Image, Ints
from tracking.detect.person_size import ENOUGH, KEPT, PersonSize
from tracking.filters import existence
from tracking.filters.existence import ScoreCalibration
from tracking.papers.blob import box_geometry, person_look_kernels
from tracking.papers.blob.ellipse_tracks import TrackedEllipses
from tracking.papers.blob.tracked_people import LEAST_EXISTENCE
from tracking.papers.blob.tracked_people_kernels import LIKELY
from tracking.papers.blob.update_from_boxes import measured_boxes

EXP = {"look": 3.0, "noise": 1.0, "learn": 2, "shift": 1, "ran": 0.05}
HALF_NORMAL = 0.4549  # median of the square of a standard normal variable


class BoxEvidence:
    def __init__(self, people: TrackedEllipses, size: PersonSize) -> None:
        self.people, self.size, self.scores = people, size, ScoreCalibration()
        self.pairs = np.zeros((0, 8))
        self.rows, self.box = np.zeros(0, np.int64), np.zeros((0, 4))
        self._calibrate()

    def measure(self, t: float, detections: Detections, image: Image | None, gate: float) -> Ints:
        """Updates the tracks with the boxes of a frame, starts tracks, and returns the rows of measured tracks."""
        people = self.people
        raw, score = measured_boxes(detections)
        box = self._as_seen(raw)
        z = box_geometry.inscribed_ellipses(np.concatenate([box[:, :2], box[:, 2:] / self.size.box_over_ellipse], 1))
        ran = 1.0
        if not len(z):
            people.expect(people.config.detect_prob)
            none = np.prod(1 - people.existence() * people.detectable)
            ran = none * (1 - EXP["ran"]) / (none * (1 - EXP["ran"]) + EXP["ran"])
        people.expect(ran * people.config.detect_prob)
        d2, log_det = people.innovations(np.ascontiguousarray(z[:, :4]), self.noise)
        rows, columns = np.nonzero(d2 <= gate)
        d2, ratio, free = d2[rows, columns], self.scores.ratios(score), np.ones(len(z), bool)
        evidence = people.evidence(rows, d2, log_det[rows])
        if image is not None and EXP["look"]:
            at = box_geometry.standing(box)
            evidence = evidence + EXP["look"] * person_look_kernels.pair_fits(image, at, people.look, rows, columns)
        r = people.existence()
        states = np.stack([r * people.detector, r * (1 - people.detector), 1 - r])
        best = people.associate(rows, columns, d2, evidence, ratio[columns], states)
        free[columns[best] if people.by_existence else columns] = False
        rows, columns, evidence = rows[best], columns[best], evidence[best]
        noise = np.tile(self.noise, (len(rows), 1))
        people.update(rows, z[columns], noise, np.full(len(rows), np.inf))
        people.measure_on_ground(rows, box[columns], self.noise)
        if people.by_existence:
            existence.update_by_detector(
                people.states, people.detector, people.lasting, rows, people.detectable, np.exp(evidence), ratio[columns]
            )
        people.measured[:] = False
        people.measured[rows] = True
        person = people.new_people(np.ascontiguousarray(z[:, :4]), free, ratio, last=False)
        person[columns] = people.existence()[rows]
        self.scores.add(score, person)
        free &= (person >= LEAST_EXISTENCE) | (not people.by_existence)
        self.rows, self.box = rows, raw[columns]
        first = len(people.id)
        people.start_tracks(z[free], score[free], t, person[free], boxed=True)
        if people.by_existence:
            people.confirmed[:] = people.existence() >= LIKELY
        return np.concatenate([rows, np.arange(first, len(people.id))])

    def learn(self, rows: Ints, person: Array) -> None:
        """Learns the size of boxes from people at `rows` (K,) with lone blobs, whose boxes are `person` (K, 4)."""
        _, mine, theirs = np.intersect1d(self.rows, rows, assume_unique=True, return_indices=True)
        if len(mine):
            scale = self.people.scale[self.rows[mine], None]
            new = np.concatenate([self.box[mine] / scale, person[theirs] / scale], 1)
            self.pairs = np.concatenate([self.pairs, new])[-KEPT:]
            self._calibrate()

    def _calibrate(self) -> None:
        c = self.people.config
        box, person = self.pairs[:, :4], self.pairs[:, 4:]
        self.over_person = np.median(np.concatenate([box[:, 2:] / person[:, 2:], np.ones((ENOUGH, 2))]), 0)
        away = box[:, :2] - person[:, :2]
        self.shift = np.median(np.concatenate([away, np.zeros((ENOUGH, 2))]), 0) * EXP["shift"]
        off = np.concatenate([away - self.shift, box[:, 2:] / self.over_person - person[:, 2:]], 1)
        noise = self.people.noise * EXP["noise"]
        self.noise = noise
        if EXP["learn"] == 2:
            prior = np.tile(noise * HALF_NORMAL, (ENOUGH, 1))
            self.noise = np.maximum(noise, np.median(np.concatenate([np.square(off), prior]), 0) / HALF_NORMAL)
        if EXP["learn"] == 1:
            prior = np.tile(noise * HALF_NORMAL, (ENOUGH, 1))
            self.noise = np.median(np.concatenate([np.square(off), prior]), 0) / HALF_NORMAL

    def _as_seen(self, box: Array) -> Array:
        scale = self.people._scale_of(box)[:, None]
        return np.concatenate([box[:, :2] - self.shift * scale, box[:, 2:] / self.over_person], 1)
