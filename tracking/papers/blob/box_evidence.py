"""What a detector's boxes tell of the tracks of `blob` beside the picture (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Detections, Image, Ints
from tracking.detect.person_size import PersonSize
from tracking.filters import existence
from tracking.filters.existence import ScoreCalibration
from tracking.papers.blob import box_geometry, person_look_kernels
from tracking.papers.blob.ellipse_tracks import TrackedEllipses
from tracking.papers.blob.person_template_search_kernels import LOOK_EVIDENCE
from tracking.papers.blob.tracked_people import LEAST_EXISTENCE
from tracking.papers.blob.tracked_people_kernels import LIKELY
from tracking.papers.blob.update_from_boxes import measured_boxes


class BoxEvidence:
    def __init__(self, people: TrackedEllipses, size: PersonSize) -> None:
        self.people, self.size, self.scores = people, size, ScoreCalibration()

    def measure(self, t: float, detections: Detections, image: Image | None, gate: float) -> Ints:
        """Updates the tracks with the boxes of a frame, starts tracks, and returns the rows of measured tracks."""
        people = self.people
        box, score = measured_boxes(detections)
        people.expect(people.config.detect_prob)
        z = box_geometry.inscribed_ellipses(np.concatenate([box[:, :2], box[:, 2:] / self.size.box_over_ellipse], 1))
        d2, log_det = people.innovations(np.ascontiguousarray(z[:, :4]))
        rows, columns = np.nonzero(d2 <= gate)
        d2, ratio, free = d2[rows, columns], self.scores.ratios(score), np.ones(len(z), bool)
        evidence = people.evidence(rows, d2, log_det[rows])
        if image is not None:
            at = box_geometry.standing(box)
            evidence = evidence + LOOK_EVIDENCE * person_look_kernels.pair_fits(image, at, people.look, rows, columns)
        best = people.associate(rows, columns, d2, evidence, ratio[columns])
        free[columns[best] if people.by_existence else columns] = False
        rows, columns, evidence = rows[best], columns[best], evidence[best]
        noise = np.tile(people.noise, (len(rows), 1))
        people.update(rows, z[columns], noise, np.full(len(rows), np.inf))
        people.measure_on_ground(rows, box[columns], people.noise)
        if people.by_existence:
            existence.update(people.states, rows, people.detectable, np.exp(evidence), ratio[columns])
        person = people.new_people(np.ascontiguousarray(z[:, :4]), free, ratio, last=False)
        person[columns] = people.existence()[rows]
        self.scores.add(score, person)
        free &= (person >= LEAST_EXISTENCE) | (not people.by_existence)
        first = len(people.id)
        people.start_tracks(z[free], score[free], t, person[free])
        if people.by_existence:
            people.confirmed[:] = people.existence() >= LIKELY
        return np.concatenate([rows, np.arange(first, len(people.id))])
