"""One frame of `blob` from boxes: the cascade of Gonzalez et al. (2006) on a detector's boxes.

Order of a frame, with the paper's sections: predict (sec. 4.2, eqs 1, 2), gate (sec. 4.3, eqs 8 to 10), associate (sec.
4.4), update (sec. 4.2, eqs 3 to 7), update on the ground where a camera is known (ours; tracked_people), manage the
tracks (secs. 4.5, 5, or by existence, ours; tracked_people). A measurement z is a centred box (x, y, h, w), px, with
a score from 0 to 1.
"""

from __future__ import annotations

import warnings

import numpy as np

from sim.types import Array, Detections, Frame, Ints
from tracking.detect.box_motion import BoxMotion
from tracking.filters import kalman
from tracking.filters.existence import ScoreCalibration
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import CONFIRM_GATE, BlobConfig
from tracking.papers.blob.tracked_people import LEAST_EXISTENCE, TrackedPeople
from tracking.running import image_scale

MOVES = (
    "the camera moves: all boxes jump together, as people do not. Tracks follow the picture, and a place in it is no "
    "place on the ground"
)
# s: time constant with which rates of height and width return to zero. Without it a missed person shrinks or grows on.
SIZE_RATE_TIME = 1.0


class BoxUpdater:
    """Updates the tracks of `people`, a table that must follow `config` already, from the boxes of each frame.

    State: people, the table of tracks; scores, the calibration of scores; gate, confirm_gate: largest d^2 (squared
    Mahalanobis distance) of an association and of a measurement that may confirm a track; fading (5, 1, 4): factors
    of the filters in each frame; motion, what the boxes tell of a camera that moves.
    """

    def __init__(self, config: BlobConfig, people: TrackedPeople) -> None:
        self.people, self.scores, self.motion = people, ScoreCalibration(), BoxMotion(people.context.fps)
        self.follow(config)

    def follow(self, config: BlobConfig) -> None:
        """Replaces the config and computes the gates anew; `people` must follow the config already."""
        from scipy.special import chdtri

        self.gate, self.confirm_gate = chdtri(4, 1 - np.array([config.gate, CONFIRM_GATE]))  # eq. 10
        self.fading = kalman.fading(np.exp(-self.people.dynamics.dt / SIZE_RATE_TIME * np.array([0, 0, 1, 1])))

    def step(self, frame: Frame, detections: Detections | None) -> None:
        """Updates the tracks with a frame's detections: predict, associate, update, confirm, delete, start."""
        z, score = measured_boxes(detections)
        people = self.people
        if len(z):
            image_scale.required(people.px_per_m)
        people.predict(observed=detections is not None)
        if people.by_existence:
            people.bank *= self.fading
        self._follow_camera(z, frame.t)
        people.widen_view(z)
        d2, log_det = people.innovations(z)
        rows, columns = np.nonzero(d2 <= self.gate)
        d2, ratio, free = d2[rows, columns], self.scores.ratios(score), np.ones(len(z), bool)
        evidence = people.evidence(rows, d2, log_det[rows])
        best = people.associate(rows, columns, d2, evidence, ratio[columns])
        free[columns[best] if people.by_existence else columns] = False
        rows, columns, d2, evidence = rows[best], columns[best], d2[best], evidence[best]
        kalman.update(people.bank, rows, z[columns], people.noise)
        people.measure_on_ground(rows, z[columns], people.noise)
        people.record_measured(rows, d2 <= self.confirm_gate, score[columns], evidence, ratio[columns])
        person = people.new_people(z, free, ratio)
        person[columns] = people.existence()[rows]
        self.scores.add(score, person)
        free &= (person >= LEAST_EXISTENCE) | (not people.by_existence)
        people.delete_tracks(frame.t)
        people.start_tracks(z[free], score[free], frame.t, person[free])

    @property
    def camera_moves(self) -> bool:
        """True if the camera was found to move."""
        return self.motion.moves

    def _follow_camera(self, z: Array, t: float) -> None:
        people, known = self.people, self.motion.moves
        move = self.motion.shift(z, people.upright_boxes()[people.confirmed], people.px_per_m, t)
        if self.motion.moves and not known:
            warnings.warn(MOVES, stacklevel=2)
        if move is not None:
            people.bank[kalman.PLACE, :, :2] += move

    def reported_boxes(self, rows: Ints) -> Array:
        """Returns the boxes (K, 4) that the tracker reports for the tracks at positions `rows` (K,): centre x, y,
        height, width, px."""
        return self.people.upright_boxes()[rows]


def measured_boxes(detections: Detections | None) -> tuple[Array, Array]:
    """Returns the boxes (M, 4), centre x, y, height, width, px, and their scores (M,), the highest first. Boxes without
    an area are left out; None gives no box."""
    if detections is None or detections.box is None or not len(detections.box):
        return np.zeros((0, 4)), np.zeros(0)
    score = detections.score if len(detections.score) else np.ones(len(detections.box))
    good = np.flatnonzero((detections.box[:, 2] > 0) & (detections.box[:, 3] > 0))
    # of two boxes on one body the second is the one with the lower score, whatever their order in the file
    order = good[np.lexsort((*detections.box[good].T, -score[good]))]
    return box_geometry.centred_from_ltwh(detections.box[order]), score[order]
