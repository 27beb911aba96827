"""Background subtraction, slow and obvious: arrays of numpy, one operation after the other."""

from __future__ import annotations

import numpy as np

from tracking.detect import background_training, background_training_kernels


def distortions(image, mean, sigma):
    """alpha and CD of pixels (..., 3): min over alpha of |(I - alpha E) / sigma|, and where it is (eqs 5, 6)."""
    line, value = mean / sigma, image / sigma
    alpha = np.sum(value * line, axis=-1) / np.sum(line * line, axis=-1)
    return alpha, np.sqrt(np.sum(np.square(value - alpha[..., None] * line), axis=-1))


def spread(values):
    """Of (K, h, w, 3): mean, sigma of the inliers, inliers (K, h, w), valid pixels (h, w), second colour (h, w, 3)."""
    frames, *size = values.shape[:3]
    held = max(int(np.ceil(background_training.SHARE * frames)), 3)
    fewest = max(int(np.ceil(background_training.SECOND_SHARE * frames)), 3)
    mean, sigma, second = (np.full((*size, 3), np.nan) for _ in range(3))
    inlier, valid = np.zeros((frames, *size), bool), np.zeros(size, bool)
    for place in np.ndindex(*size):
        colours = values[:, *place]
        first = guess(colours, held)
        valid[place] = first[1].max() <= background_training_kernels.WIDEST
        mean[place], sigma[place], inlier[:, *place] = settle(colours, *first)
        others = colours[~inlier[:, *place]]
        if len(others) < fewest:
            continue
        other = guess(others, max(fewest, held * len(others) // frames))
        if other[1].max() <= background_training_kernels.WIDEST:
            second[place] = other[0]
            settled = settle(colours, *other)
            if settled[2].sum() > inlier[:, *place].sum():
                second[place] = mean[place]
                mean[place], sigma[place], inlier[:, *place] = settled
    return mean, sigma, inlier, valid, second


def settle(colours, mean, sigma):
    """Mean and sigma of the inliers of one pixel's colours (K, 3), and the inliers (K,)."""
    for _ in range(background_training_kernels.ROUNDS):
        inlier = np.all(np.abs(colours - mean) <= background_training_kernels.INLIER * sigma, axis=-1)
        if inlier.any():
            mean, sigma = colours[inlier].mean(0), colours[inlier].std(0)
        mean, sigma = np.maximum(mean, 1.0), np.maximum(sigma, background_training_kernels.FLOOR)
    return mean, sigma, inlier


def guess(colours, held):
    """Middle and sigma of a cluster of colours (K, 3): in the widest channel the shortest interval of `held`."""
    main = int(np.argmax(np.ptp(colours, axis=0)))
    middle, length, low = shortest(colours[:, main], held)
    cluster = colours[(colours[:, main] >= low) & (colours[:, main] <= low + length)]
    mean, sigma = np.zeros(3), np.zeros(3)
    for k in range(3):
        mean[k], length, _ = shortest(cluster[:, k], (len(cluster) + 1) // 2)
        sigma[k] = length / 2 * background_training_kernels.HALF_AS_SIGMA
    mean[main], length, _ = middle, *shortest(colours[:, main], held)[1:]
    sigma[main] = length / 2 * background_training_kernels.AS_SIGMA
    return mean, np.maximum(sigma, background_training_kernels.FLOOR)


def shortest(values, held):
    """Middle value, length and start of the shortest interval that holds `held` of the values (K,)."""
    v = np.sort(values)
    first = int((v[held - 1 :] - v[: len(v) - held + 1]).argmin())
    return v[first + held // 2], v[first + held - 1] - v[first], v[first]


def normalisers(values, mean, sigma, inlier):
    """s and b (h, w): RMS of (alpha - 1) |E / sigma| and of CD over the inliers, no less than FLOOR grey levels."""
    alpha, cd = distortions(values, mean, sigma)
    length = np.sqrt(np.sum(np.square(mean / sigma), axis=-1))
    n = np.maximum(inlier.sum(axis=0), 1)
    s, b = (np.sqrt(np.sum(np.square(q), axis=0, where=inlier) / n) for q in ((alpha - 1) * length, cd))
    least = background_training_kernels.FLOOR / sigma.mean(axis=-1)
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
    spread = np.maximum(var + fast * (np.square(away * gain) - var), background_training_kernels.FLOOR**2)
    moved = np.maximum(mean + np.where(seen, fast, slow) * away, 1.0)
    return np.where(moves, moved, mean), np.where(moves & seen, spread, var)


def watch(image, gain, reach, colour, sightings):
    """Mean colour (3, H, W) since the last change, and sightings since then (H, W), after one more picture."""
    seen = np.moveaxis(image.astype(float), -1, 0) / gain[:, None, None]
    same = np.all(np.abs(seen - colour) <= reach[:, None, None], axis=0)
    sightings = np.where(same, sightings + 1, 1)
    return colour + (seen - colour) / np.minimum(sightings, 30), sightings
