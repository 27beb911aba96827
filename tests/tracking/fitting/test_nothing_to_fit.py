"""Recordings without frames, without scores, and polygons without vertices are no error."""

import numpy as np

from sim.geometry.polygons import iou_matrix, pack
from sim.types import Detections, Truth
from tracking.app.pictures.contact_sheet import choose_frames
from tracking.fitting.detection_matching import match_detections
from tracking.fitting.error_statistics import error_statistics
from tracking.fitting.false_alarms import fit_false_alarms

NONE = np.zeros(0, np.int64)
EMPTY = Truth("none", 10.0, 0, 40.0, NONE, NONE, NONE, None, None, np.zeros((0, 4)), np.zeros(0))


def test_a_recording_without_frames():
    matched = match_detections(EMPTY, [], (64, 48))
    assert fit_false_alarms([matched]) == (0.0, None)
    assert all(np.isnan(v) for v in error_statistics([matched]).values())
    assert choose_frames(EMPTY, 8) == []


def test_boxes_without_scores():
    box = np.array([[10.0, 10, 8, 20]])
    one = np.ones(1, np.int64)
    truth = Truth("one", 10.0, 1, 40.0, one, one, -one, None, None, box, np.ones(1))
    matched = match_detections(truth, [Detections(1, 0.0, "image", box[:, :2], None, box)], (64, 48))
    assert matched.score.tolist() == [1.0]


def test_polygons_without_vertices():
    empty = np.zeros((0, 2))
    assert iou_matrix([empty, empty], [empty]).tolist() == [[0.0], [0.0]]
    assert len(pack([empty], 0).vertex) == 1
