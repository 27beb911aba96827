"""`fit_sensor`: a detector's whole profile, from its detections on labelled recordings to a `[sensor]` table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.sensor import Sensor
from sim.types import Array
from sim.types import Sequence as Recording
from tracking.fitting.box_noise import fit_noise, point_noise
from tracking.fitting.detection_matching import MatchedRecording, match_sequence
from tracking.fitting.false_alarms import fit_alarms
from tracking.fitting.misses import fit_misses

SCORES = 11  # quantiles
LEAST = 50  # labelled people (rows): fewer are no profile
FEW_SCORES = 20


def fit_sensor(sequences: Iterable[Recording] | Recording) -> Sensor:
    """The sensor that errs as the detector did on these recordings, all pooled.

    InputError where one of them has no labels, no detections or no boxes, and where hardly anybody is labelled or
    detected.
    """
    recordings = [sequences] if isinstance(sequences, Recording) else list(sequences)
    return fit([match_sequence(s) for s in recordings])


def fit(recordings: Sequence[MatchedRecording]) -> Sensor:
    """The sensor of recordings whose detections are matched."""
    people, hits = sum(len(m.match) for m in recordings), sum(int(m.hit.sum()) for m in recordings)
    if people < LEAST or hits < LEAST // 2:
        name = recordings[0].truth.name if recordings else "fit sensor"
        raise InputError(
            file=name, got=f"{people} labelled people, {hits} of them detected",
            expected=f"at least {LEAST} and {LEAST // 2}, of all frames together",
            remedy="give more frames, or check that gt and det are of the same recording",
        )  # fmt: skip
    chance, luck = fit_misses(recordings)
    kind, noise = fit_noise(recordings)
    rate, alarms = fit_alarms(recordings)
    own = point_noise(recordings)
    height = float(np.median(np.concatenate([m.truth.box[:, 3] for m in recordings if m.truth.box is not None])))
    edges = height * float(np.sqrt(np.mean(np.square([noise.foot[1], noise.top[1], noise.across[1]]))))
    true = np.concatenate([m.score[m.match[m.hit]] for m in recordings])
    false = np.concatenate([m.score[m.false] for m in recordings])
    return Sensor(
        detect_prob=_digits(chance.best),
        clutter_rate=_digits(rate),
        noise_px=_digits(edges),
        noise_m=Sensor().noise_m if own is None else _digits(own),
        box=kind,
        min_visibility=0.0,
        small_px=chance.small,
        by_visibility=tuple(_digits(c) for c in chance.curve),
        miss_memory=luck or None,
        box_noise=noise,
        points="foot" if own is None else "own",
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
