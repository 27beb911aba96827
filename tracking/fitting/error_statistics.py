"""Statistics of a detector's errors (misses, false alarms, boxes, scores), to compare a simulated with a real one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from scenarios.schema.sensor import Sensor
from sim.detector.box_noise import box_errors
from sim.detector.sense import sense
from sim.geometry.boxes import box_iou
from sim.types import Array, Ints
from tracking.fitting.detection_matching import MatchedRecording, match_detections
from tracking.fitting.error_correlation import pairs_by_lag
from tracking.fitting.false_alarms import alarm_tracks

LAG = 0.2  # s: of the error correlation


def simulated_detections(m: MatchedRecording, sensor: Sensor, seed: int) -> MatchedRecording:
    """Returns the recording with its detections replaced by those of a simulated sensor, matched to the labels."""
    found = sense(m.truth, sensor, seed, m.camera, m.size)
    return match_detections(m.truth, found, m.size, m.camera)


def error_statistics(recordings: Sequence[MatchedRecording]) -> dict[str, float]:
    """Returns nine statistics of a detector's errors by name, all recordings pooled; nan where nothing was observed."""
    runs = np.concatenate([miss_runs(m) / m.truth.fps for m in recordings])
    frames = sum(m.truth.length for m in recordings)
    alarms = [track for m in recordings for track in alarm_tracks(m)]
    seen = np.array([len(a.rows) for a in alarms], dtype=float)
    stay = np.array([(np.ptp(a.frame) + 1) / a.recording.truth.fps for a in alarms])
    true = np.concatenate([np.zeros((0, 4)), *(m.truth.box[m.hit] for m in recordings if m.truth.box is not None)])
    box = np.concatenate([m.box[m.match[m.hit]] for m in recordings])
    overlap = box_iou(true, box)
    return {
        "missed": _known(np.mean, np.concatenate([~m.hit for m in recordings])),
        "misses: mean run, s": _known(np.mean, runs),
        "false alarms per frame": float(seen.sum()) / frames if frames else float("nan"),
        "false alarms: at people": _known(np.average, np.array([a.person >= 0 for a in alarms]), None, seen),
        "false alarms: mean stay, s": _known(np.mean, stay),
        **{f"overlap, {q:.0%} quantile": _known(np.quantile, overlap, q) for q in (0.1, 0.5, 0.9)},
        f"error correlation after {LAG:g} s": _correlation(recordings, box_errors(box, true)),
    }


def miss_runs(m: MatchedRecording) -> Ints:
    """Returns the length, in frames, of each run of successive frames in which a labelled person is missed, (K,)."""
    lengths = []
    for id in np.unique(m.truth.id):
        rows = np.flatnonzero(m.truth.id == id)
        start = np.concatenate([[True], np.diff(m.truth.frame[rows]) > 1])
        lost = ~m.hit[rows]
        begins = lost & (start | np.concatenate([[True], ~lost[:-1]]))
        lengths.append(np.bincount(np.cumsum(begins)[lost] - 1) if lost.any() else np.zeros(0, np.int64))
    return np.concatenate([np.zeros(0, np.int64), *lengths])


def _correlation(recordings: Sequence[MatchedRecording], e: Array) -> float:
    """Returns the correlation of one person's errors about `LAG` apart, nan without any; e (H, 4)."""
    if not len(e):
        return float("nan")
    products, first = [np.zeros((0, 4))], 0
    mean, sd = e.mean(axis=0), np.maximum(e.std(axis=0), 1e-9)
    for m in recordings:
        z = np.full((len(m.truth.id), 4), np.nan)
        z[m.hit] = (e[first : first + int(m.hit.sum())] - mean) / sd
        first += int(m.hit.sum())
        products += [z[i] * z[j] for lag, i, j in pairs_by_lag(m.truth, m.hit) if abs(lag - LAG) <= 0.5 * LAG]
    return _known(np.mean, np.concatenate(products))


def _known(statistic: Callable[..., Any], a: Array, *more: Any) -> float:
    return float(statistic(a, *more)) if len(a) else float("nan")
