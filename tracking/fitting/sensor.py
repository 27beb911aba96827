"""`fit_sensor`: fits the whole profile of a detector, a `[sensor]` table, to its detections on labelled recordings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.sensor import Sensor
from sim.types import Array
from sim.types import Sequence as Recording
from tracking.fitting.box_noise import fit_box_noise, fit_points
from tracking.fitting.detection_matching import MatchedRecording, match_sequence
from tracking.fitting.false_alarms import fit_false_alarms
from tracking.fitting.misses import fit_misses

SCORES = 11  # number of quantiles of the scores, evenly spaced from 0 to 1
LEAST = 50  # least number of labelled rows
FEW_SCORES = 20  # with fewer scores, no quantiles are given


def fit_sensor(sequences: Iterable[Recording] | Recording) -> Sensor:
    """Returns the sensor whose errors are like those of the detector on these recordings, pooled."""
    recordings = [sequences] if isinstance(sequences, Recording) else list(sequences)
    return fit_matched([match_sequence(s) for s in recordings])


def fit_matched(recordings: Sequence[MatchedRecording]) -> Sensor:
    """Returns the sensor whose errors are like those of the detector on matched recordings, pooled."""
    people, hits = sum(len(m.match) for m in recordings), sum(int(m.hit.sum()) for m in recordings)
    if people < LEAST or hits < LEAST // 2:
        name = recordings[0].truth.name if recordings else "fit sensor"
        raise InputError(
            file=name, got=f"{people} labelled people, {hits} of them detected",
            expected=f"at least {LEAST} and {LEAST // 2}, of all frames together",
            remedy="give more frames, or check that gt and det are of the same recording",
        )  # fmt: skip
    detection, miss_memory = fit_misses(recordings)
    kind, noise = fit_box_noise(recordings)
    rate, alarms = fit_false_alarms(recordings)
    points, noise_m = fit_points(recordings, kind)
    true = np.concatenate([m.score[m.match[m.hit]] for m in recordings])
    false = np.concatenate([m.score[m.false] for m in recordings])
    return Sensor(
        detect_prob=_digits(detection.best),
        clutter_rate=_digits(rate),
        noise_m=Sensor().noise_m if noise_m is None else _digits(noise_m),
        box=kind,
        min_visibility=0.0,
        small_px=detection.small,
        by_visibility=tuple(_digits(c) for c in detection.curve),
        miss_memory=miss_memory or None,
        box_noise=noise,
        points=points,
        false_alarms=alarms,
        true_scores=_quantiles(true),
        false_scores=_quantiles(false),
    )


def _digits(x: float) -> float:
    return float(f"{x:.4g}")


def _quantiles(score: Array) -> tuple[float, ...] | None:
    if len(score) < FEW_SCORES:
        return None
    return tuple(round(float(q), 4) for q in np.quantile(score, np.linspace(0.0, 1.0, SCORES)))
