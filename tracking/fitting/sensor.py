"""`fit_sensor`: fits the whole profile of a detector, a `[sensor]` table, to its detections on labelled recordings.

Fits the probability of detection, P · c(visibility), and how long misses persist. P is the probability in full view.
The factor c is piecewise linear over 5 evenly spaced visibilities and rises to c(1) = 1. P and c have the greatest
likelihood.

Fits the errors of detected boxes: mean and standard deviation, growth with occlusion, tails, and memory over time.

Input: recordings whose detections are matched to labelled people. Errors are the four of
`sim.detector.box_noise.box_errors`: of a box's middle (to the right), foot and top (downwards), in heights of the
labelled box, and the logarithm of detected over labelled width. Their standard deviation is sd (1 + occluded (1 -
visibility)): sd that of a person in full view, occluded its growth with the hidden share, visibility the visible share.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.sensor import BoxNoise, Memory, Sensor
from sim.detector.box_noise import box_errors, seen_shift
from sim.detector.sense import sensed_boxes
from sim.scene.camera import foot_points
from sim.types import Array
from sim.types import Sequence as Recording
from tracking.fitting.detection_matching import MatchedRecording, match_sequence
from tracking.fitting.error_correlation import correlations, fit_memory, miss_correlations
from tracking.fitting.false_alarms import fit_false_alarms

NODES = 5
PRIOR = 2.0  # weight, in rows per node, of the prior that c equals the visibility
FEW_MISSES = 10  # with fewer misses in all, no memory is fitted


def fit_misses(recordings: Sequence[MatchedRecording]) -> tuple[float, Array, tuple[Memory, ...]]:
    """Returns the probability of detection in full view, its factors c at the visibilities 0, 0.25, 0.5, 0.75 and 1,
    and the parts of the misses' memory, () with fewer than 10 misses."""
    from scipy.optimize import minimize

    hit = np.concatenate([m.hit for m in recordings])
    visibility = np.concatenate([m.truth.visibility for m in recordings])
    levels = np.linspace(0.0, 1.0, NODES)
    weights = np.stack([np.interp(visibility, levels, row) for row in np.eye(NODES)], axis=1)

    def curve(x: Array) -> Array:
        steps = 1.0 / (1.0 + np.exp(-x))  # P, then c[k] / c[k + 1] from the last to the first
        return np.asarray(np.cumprod(steps)[::-1])

    def loss(x: Array) -> float:
        c = curve(x)
        p = np.clip(weights @ c, 1e-6, 1.0 - 1e-6)
        believed = np.clip(c / c[-1], 1e-6, 1.0 - 1e-6)[:-1]
        prior = PRIOR * (levels[:-1] * np.log(believed) + (1.0 - levels[:-1]) * np.log(1.0 - believed)).sum()
        return -float(np.where(hit, np.log(p), np.log(1.0 - p)).sum() + prior)

    found = minimize(loss, np.array([2.0, 1.0, 0.5, 0.0, -1.0]), method="L-BFGS-B", bounds=[(-9.0, 9.0)] * NODES)
    best = float(curve(found.x)[-1])
    factors = curve(found.x) / best
    if (~hit).sum() < FEW_MISSES:
        return best, factors, ()
    p_miss = [1.0 - best * np.interp(m.truth.visibility, levels, factors) for m in recordings]
    pairs = zip(recordings, p_miss, strict=True)
    return best, factors, fit_memory([miss_correlations(m.truth, ~m.hit, p) for m, p in pairs])


GROWTH = np.concatenate([[0.0], np.geomspace(0.1, 6.0, 40)])  # values of `occluded` to choose from
TAILS = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 20.0)  # excess kurtoses to choose from
HALF = (0.3, 0.9)  # a row counts as half hidden if its visibility is between these
BARELY = 0.25  # visibility: rows below it are left out, as their nearest box often belongs to someone else
POINTS: tuple[Literal["own", "seen", "foot"], ...] = ("own", "seen", "foot")  # in order of preference
FEW = 20  # with fewer half hidden rows, boxes are taken as amodal and errors as independent of visibility


def fit_box_noise(recordings: Sequence[MatchedRecording]) -> tuple[Literal["visible", "amodal"], BoxNoise]:
    """Returns whether detected boxes enclose the visible part ("visible") or the whole person ("amodal"); their errors.

    If every detected row is less than a quarter visible, means, standard deviations and `occluded` are 0, and `memory`
    is None.
    """
    kind: Literal["visible", "amodal"] = "visible" if _of_visible_part(recordings) else "amodal"
    errors = [_errors(m, kind) for m in recordings]
    hidden = [1.0 - m.truth.visibility[m.hit] for m in recordings]
    mean, sd, occluded = _fit_spread(np.concatenate(errors), np.concatenate(hidden))
    correlated, standardised = [], []
    for m, e, share in zip(recordings, errors, hidden, strict=True):
        z = np.full((len(m.truth.id), 4), np.nan)
        z[m.hit] = (e - mean) / np.maximum(sd * (1.0 + occluded * share)[:, None], 1e-9)
        correlated.append(correlations(m.truth, z, m.hit))
        standardised.append(z[m.hit])
    across, foot, top, width = [(round(float(a), 4), round(float(b), 4)) for a, b in zip(mean, sd, strict=True)]
    heights = np.concatenate([_true(m, kind)[:, 3] for m in recordings])
    least = float(sd[:3].min() * np.median(heights)) if len(heights) else 0.0
    return kind, BoxNoise(
        across=across, foot=foot, top=top, width=width, occluded=round(occluded, 3),
        tails=_tails(np.concatenate(standardised)), floor_px=round(min(BoxNoise().floor_px, least), 4),
        memory=(fit_memory(correlated) if sd.max() > 1e-6 else ()) or None,
    )  # fmt: skip


def _fit_spread(e: Array, hidden: Array) -> tuple[Array, Array, float]:
    """Returns mean (4,), standard deviation in full view (4,), and `occluded` of errors e (H, 4); hidden (H,):
    1 - visibility. Of each `occluded` tried, the one of the greatest likelihood."""
    clear = hidden <= 1.0 - BARELY
    e, hidden = e[clear], hidden[clear]
    if not len(e):
        return np.zeros(4), np.zeros(4), 0.0
    found = []
    for k in GROWTH if (hidden > 1.0 - HALF[1]).sum() >= FEW else GROWTH[:1]:
        growth = 1.0 + float(k) * hidden
        weight = 1.0 / growth**2
        mean = weight @ e / weight.sum()
        sd = np.sqrt(np.mean((e - mean) ** 2 * weight[:, None], axis=0))
        near = np.mean(np.abs(e - mean) / growth[:, None], axis=0)  # scale of the Laplace distribution
        # of a Laplace distribution, which large errors influence little
        likelihood = -len(e) * float(np.log(np.maximum(near, 1e-6)).sum()) - 4 * float(np.log(growth).sum())
        found.append((likelihood, mean, sd, float(k)))
    return max(found, key=lambda fit: fit[0])[1:]


def _tails(z: Array) -> float:
    """Returns the likeliest excess kurtosis of TAILS for Student-t errors of variance 1."""
    from scipy.special import gammaln

    def likelihood(tails: float) -> float:
        if not tails:
            return -0.5 * float((z**2 + np.log(2 * np.pi)).sum())
        # the excess kurtosis of a Student-t distribution is 6 / (v - 4)
        v = 4.0 + 6.0 / tails
        level = gammaln((v + 1) / 2) - gammaln(v / 2) - 0.5 * np.log(np.pi * (v - 2))
        return float((level - (v + 1) / 2 * np.log1p(z**2 / (v - 2))).sum())

    return max(TAILS, key=likelihood)


def _of_visible_part(recordings: Sequence[MatchedRecording]) -> bool:
    """True if detected boxes of half hidden people are nearer to the visible part than to the whole box."""
    away: dict[str, list[Array]] = {"visible": [], "amodal": []}
    for m in recordings:
        visibility = m.truth.visibility[m.hit]
        half, whole = (visibility > HALF[0]) & (visibility < HALF[1]), visibility >= HALF[1]
        for kind, errors in away.items():
            e = _errors(m, kind)
            usual = np.median(e[whole], axis=0) if whole.any() else np.zeros(4)
            errors.append(np.abs(e[half] - usual)[:, :3] * _true(m, kind)[half, 3:])
    both = {kind: np.concatenate(errors) for kind, errors in away.items()}
    return len(both["visible"]) >= FEW and float(both["visible"].mean()) < float(both["amodal"].mean())


def _errors(m: MatchedRecording, kind: str) -> Array:
    """Returns the errors (H, 4) of the H detected rows against their labelled boxes of a kind."""
    return box_errors(m.box[m.match[m.hit]], _true(m, kind))


def _true(m: MatchedRecording, kind: str) -> Array:
    boxes = sensed_boxes(m.truth, kind)
    assert boxes is not None
    return boxes[m.hit]


def fit_points(
    recordings: Sequence[MatchedRecording], kind: str
) -> tuple[Literal["own", "seen", "foot"], float | None]:
    """Returns the value of `points` that explains the detections' ground positions best, and the standard deviation of
    the positions from it, m. Without positions, or if "foot" is best, the result is ("foot", None)."""
    found = [_point_errors(m, kind) for m in recordings if m.pos is not None and m.truth.pos is not None]
    e = np.concatenate([np.zeros((3, 0, 2)), *found], axis=1)
    best = int(np.abs(e).sum(axis=(1, 2)).argmin())
    if best == POINTS.index("foot") or not e.shape[1]:
        return "foot", None
    return POINTS[best], float(np.sqrt(np.mean(e[best] ** 2)))


def _point_errors(m: MatchedRecording, kind: str) -> Array:
    assert m.pos is not None
    assert m.truth.pos is not None
    pos = m.pos[m.match[m.hit]]
    own = pos - m.truth.pos[m.hit]
    if m.camera is None:
        return np.stack([own, own, own])
    z = np.zeros(len(own)) if m.truth.z is None else m.truth.z[m.hit]
    seen = own - seen_shift(_true(m, kind), _true(m, "amodal"), z, m.camera)
    foot = pos - foot_points(m.box[m.match[m.hit]], z, m.camera)
    return np.stack([own, seen, np.where(np.isfinite(foot), foot, own)])


SCORES = 11  # number of quantiles of the scores, evenly spaced from 0 to 1
LEAST = 50  # least number of labelled rows
FEW_SCORES = 20  # with fewer scores, no quantiles are given


def fit_sensor(sequences: Iterable[Recording] | Recording) -> Sensor:
    """Returns the sensor settings that imitate the detector's errors on these recordings, all recordings pooled. Raises
    InputError if labels or detections are missing or too few."""
    recordings = [sequences] if isinstance(sequences, Recording) else list(sequences)
    return fit_matched([match_sequence(s) for s in recordings])


def fit_matched(recordings: Sequence[MatchedRecording]) -> Sensor:
    """Returns the sensor settings that imitate the detector's errors on matched recordings, all recordings pooled.
    Raises InputError with fewer than 50 labelled people or 25 detected ones."""
    people, hits = sum(len(m.match) for m in recordings), sum(int(m.hit.sum()) for m in recordings)
    if people < LEAST or hits < LEAST // 2:
        name = recordings[0].truth.name if recordings else "fit sensor"
        raise InputError(
            file=name, got=f"{people} labelled people, {hits} of them detected",
            expected=f"at least {LEAST} and {LEAST // 2}, of all frames together",
            remedy="give more frames, or check that gt and det are of the same recording",
        )  # fmt: skip
    detect_prob, by_visibility, miss_memory = fit_misses(recordings)
    kind, noise = fit_box_noise(recordings)
    rate, alarms = fit_false_alarms(recordings)
    points, noise_m = fit_points(recordings, kind)
    return Sensor(
        detect_prob=_digits(detect_prob), by_visibility=tuple(map(_digits, by_visibility.tolist())),
        small_px=0.0, min_visibility=0.0, miss_memory=miss_memory or None, box=kind, box_noise=noise,
        points=points, noise_m=Sensor().noise_m if noise_m is None else _digits(noise_m),
        clutter_rate=_digits(rate), false_alarms=alarms,
        true_scores=_quantiles([m.score[m.match[m.hit]] for m in recordings]),
        false_scores=_quantiles([m.score[m.false] for m in recordings]),
    )  # fmt: skip


def _digits(x: float) -> float:
    return float(f"{x:.4g}")


def _quantiles(scores: list[Array]) -> tuple[float, ...] | None:
    score = np.concatenate(scores)
    if len(score) < FEW_SCORES:
        return None
    return tuple(round(float(q), 4) for q in np.quantile(score, np.linspace(0.0, 1.0, SCORES)))
