"""Background subtraction, slow and obvious: arrays of numpy, one operation after the other."""

from __future__ import annotations

import numpy as np

from tracking.detect import background_training


def distortions(image, mean, sigma):
    """alpha and CD of pixels (..., 3): min over alpha of |(I - alpha E) / sigma|, and where it is (eqs 5, 6)."""
    line, value = mean / sigma, image / sigma
    alpha = np.sum(value * line, axis=-1) / np.sum(line * line, axis=-1)
    return alpha, np.sqrt(np.sum(np.square(value - alpha[..., None] * line), axis=-1))


def spread(values):
    """Of (K, h, w, 3): mean and sigma of the inliers, inliers (K, h, w), pixels never covered and valid ones (h, w)."""
    mean, half = shortest(values)
    sigma = np.maximum(half * background_training.AS_SIGMA, background_training.FLOOR)
    valid = np.all(sigma <= background_training.WIDEST, axis=-1)
    for _ in range(background_training.ROUNDS):
        away = np.abs(values - mean)
        inlier = np.all(away <= background_training.INLIER * sigma, axis=-1)
        clean = np.all(away <= background_training.CLEAN * sigma, axis=(0, -1))
        n = np.maximum(inlier.sum(axis=0), 1)[..., None]
        mean = np.sum(values, axis=0, where=inlier[..., None]) / n
        var = np.sum(np.square(values - mean), axis=0, where=inlier[..., None]) / n
        mean, sigma = np.maximum(mean, 1.0), np.maximum(np.sqrt(var), background_training.FLOOR)
    return mean, sigma, inlier, clean, valid


def shortest(values):
    """Median of, and half, the shortest interval that holds SHARE of the values (K, ...), per pixel and colour."""
    v = np.sort(values, axis=0)
    held = max(int(np.ceil(background_training.SHARE * len(v))), 3)
    first = (v[held - 1 :] - v[: len(v) - held + 1]).argmin(axis=0)[None]
    low, middle, high = (np.take_along_axis(v, first + k, 0)[0] for k in (0, held // 2, held - 1))
    return middle, (high - low) / 2


def normalisers(values, mean, sigma, inlier):
    """s and b (h, w): RMS of (alpha - 1) |E / sigma| and of CD over the inliers, no less than FLOOR grey levels."""
    alpha, cd = distortions(values, mean, sigma)
    length = np.sqrt(np.sum(np.square(mean / sigma), axis=-1))
    n = np.maximum(inlier.sum(axis=0), 1)
    s, b = (np.sqrt(np.sum(np.square(q), axis=0, where=inlier) / n) for q in ((alpha - 1) * length, cd))
    least = background_training.FLOOR / sigma.mean(axis=-1)
    return np.maximum(s, least), np.maximum(b, np.sqrt(2) * least)


def classify(image, mean, sigma, s, b, valid, gain, limits):
    """(H, W) classes: CD, dark, highlight, shadow, background, in the paper's order."""
    most, lower, upper, dark, bright = limits
    expected = np.minimum(gain * mean, 255)
    alpha, cd = distortions(image.astype(float), expected, sigma)
    brightness = (alpha - 1) * np.sqrt(np.sum(np.square(expected / sigma), axis=-1)) / s
    rules = [
        (~valid, 0), (cd > most * b, 1), ((brightness < lower) & (alpha < dark), 2),
        ((brightness > upper) & (alpha > bright), 1), (brightness > upper, 4), (brightness < lower, 3),
    ]  # fmt: skip
    return np.select([rule for rule, _ in rules], [kind for _, kind in rules], 0).astype(np.uint8)


def adapt(image, classes, protected, mean, var, gain, rows, fast, slow):
    """mean, var (H, W, 3) after a frame: exponential averages where background is seen, slower elsewhere."""
    moves = ~protected[..., None] & rows[:, None, None] & ~((image == 255) & (gain * mean >= 255))
    seen = (classes == 0)[..., None]
    away = image / gain - mean
    spread = np.maximum(var + fast * (np.square(away * gain) - var), background_training.FLOOR**2)
    moved = np.maximum(mean + np.where(seen, fast, slow) * away, 1.0)
    return np.where(moves, moved, mean), np.where(moves & seen, spread, var)


def watch(image, gain, reach, colour, sightings):
    """Mean colour (3, H, W) since the last change, and sightings since then (H, W), after one more picture."""
    seen = np.moveaxis(image.astype(float), -1, 0) / gain[:, None, None]
    same = np.all(np.abs(seen - colour) <= reach[:, None, None], axis=0)
    sightings = np.where(same, sightings + 1, 1)
    return colour + (seen - colour) / np.minimum(sightings, 30), sightings
