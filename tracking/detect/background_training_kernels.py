"""Kernels of tracking.detect.background_training: the model of each pixel in one pass over the sample.

Input: a sample of K frames, BGR grey levels. Output per pixel: mean E and standard deviation sigma of each channel over
its inliers (frames that show the background), and normalisers of brightness and chromaticity distortion. Numpy twins:
tests/reference_background.py. Equations: Horprasert et al. (2000).
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Image, Ints
from tracking.detect.background_kernels import Floats

# First axis of `counts`: all inliers, or all frames of the pixels that nothing covered.
INLIERS, CLEAN_PIXELS = range(2)
# Second axis of `counts`: the normalised distortions.
BRIGHTNESS, CHROMATICITY = range(2)
# Grey levels: least sigma, and least noise from which the normalisers are computed. Compressed frames stay constant
# and then jump by a level or two. With a lower floor these jumps would be foreground. OpenCV's MOG2 has 2, too.
FLOOR = 2.0
# A frame is an inlier of a pixel if all its channels lie within so many sigmas of E.
INLIER = 3.5
# Standard deviation of a Gaussian over half the length of the central interval that holds SHARE of it.
AS_SIGMA = 2.2
# Standard deviation of a Gaussian over half the length of the central interval that holds half of it.
HALF_AS_SIGMA = 1.48
# Most rounds of step 1; inliers settle after three or four.
ROUNDS = 10
# Sigmas: a pixel with any frame beyond was covered by something; all its frames are left out of the thresholds.
CLEAN = 6.0
# Grey levels: a pixel whose first sigma is larger has no background (`valid` is False).
WIDEST = 20.0
# Number of bins of the histograms, which reach from -SPAN to SPAN; values beyond are counted in the end bins.
BINS, SPAN = 4000, 20.0


@njit(cache=True)
def sort(values: Floats) -> None:
    """Sort values (K,) in place, ascending, by Shell's method, which is quick for small K. Returns nothing."""
    for gap in (13, 4, 1):
        for t in range(gap, len(values)):
            x, j = values[t], t
            while j >= gap and values[j - gap] > x:
                values[j] = values[j - gap]
                j -= gap
            values[j] = x


@njit(cache=True)
def shortest(values: Floats, held: int) -> tuple[int, float]:
    """Returns the start index and the length of the shortest interval that holds `held` neighbours of `values`.

    values (K,): sorted ascending. held: a count from 1 to K. Of equally short intervals the first is returned.
    """
    first, best = 0, values[held - 1] - values[0]
    for t in range(1, len(values) - held + 1):
        length = values[t + held - 1] - values[t]
        if length < best:
            first, best = t, length
    return first, best


@njit(cache=True)
def guess(value: Floats, shown: Bools, held: int, order: Floats, m: Array, sd: Array) -> None:
    """Writes a first mean and standard deviation of one pixel's colour, m and sd (3,), from the frames `shown` (K,).

    Of value (K, 3), the channel in which these frames differ most is taken, and its shortest interval that holds `held`
    of them. So all channels are those of the same frames. order (K,): workspace.
    """
    main, reach, low, high = 0, np.float32(-1), np.float32(0), np.float32(0)
    for k in range(3):
        n = 0
        for t in range(len(value)):
            if shown[t]:
                order[n] = value[t, k]
                n += 1
        sort(order[:n])
        if order[n - 1] - order[0] > reach:
            main, reach = k, order[n - 1] - order[0]
            first, length = shortest(order[:n], held)
            low, high = order[first], order[first + held - 1]
            m[k], sd[k] = order[first + held // 2], 0.5 * length * AS_SIGMA
    for k in range(3):
        if k != main:
            n = 0
            for t in range(len(value)):
                if shown[t] and low <= value[t, main] <= high:
                    order[n] = value[t, k]
                    n += 1
            sort(order[:n])
            half = (n + 1) // 2
            first, length = shortest(order[:n], half)
            m[k], sd[k] = order[first + half // 2], 0.5 * length * HALF_AS_SIGMA
        sd[k] = max(sd[k], FLOOR)


@njit(cache=True)
def inliers(value: Floats, m: Array, sd: Array, inlier: Bools) -> tuple[bool, int]:
    """Compute one pixel's mean E, standard deviation sigma and inlier frames in turn until they settle; all in place.

    value (K, 3): the pixel's grey levels at gain 1 in K frames. m, sd (3,): E and sigma of each channel; they hold
    first guesses on entry. inlier (K,) bool: overwritten; True for a frame whose channels lie within INLIER sigmas.

    Returns whether all frames of the pixel are clean, and the number of inliers. E stays at 1 or above, sigma at the
    least sigma or above, also if no frame is an inlier.
    """
    clean, n = True, 0
    inlier[:] = False
    for _ in range(ROUNDS):
        clean, settled = True, True
        n, sums, squares = 0, np.zeros(3), np.zeros(3)
        for t in range(len(value)):
            away = 0.0
            for k in range(3):
                away = max(away, abs(value[t, k] - m[k]) / sd[k])
            settled = settled and inlier[t] == (away <= INLIER)
            inlier[t] = away <= INLIER
            clean = clean and away <= CLEAN
            if inlier[t]:
                n += 1
                for k in range(3):
                    d = value[t, k] - m[k]
                    sums[k] += d
                    squares[k] += d * d
        many = max(n, 1)
        for k in range(3):
            shift = sums[k] / many
            m[k] = max(m[k] + shift, 1.0)  # E (eq. 3) and sigma (eq. 4) of the inliers
            sd[k] = max(np.sqrt(max(squares[k] / many - shift * shift, 0.0)), FLOOR)
        if settled:
            break
    return clean, n


@njit(cache=True)
def distortions(value: Floats, m: Array, sd: Array, inlier: Bools, alpha: Array, cd: Array) -> tuple[float, float]:
    """Returns s and b of one pixel: the RMS over its inlier frames of the two distortions, 0 if there is no inlier.

    value (K, 3): grey levels at gain 1 in K frames; m, sd (3,): mean E and standard deviation sigma of each channel;
    inlier (K,): the frames to average over. Written in place, for all frames: alpha (K,), brightness distortion (alpha
    - 1) |E / sigma|; cd (K,), chromaticity distortion. s is of `alpha` (eq. 7), b of `cd` (eq. 8).
    """
    norm = 0.0
    for k in range(3):
        norm += (m[k] / sd[k]) ** 2
    n, sa, sb = 0, 0.0, 0.0
    for t in range(len(value)):
        dot = 0.0
        for k in range(3):
            dot += value[t, k] * m[k] / (sd[k] * sd[k])
        a, q = dot / norm, 0.0  # alpha (eq. 5) and CD^2 (eq. 6)
        for k in range(3):
            q += ((value[t, k] - a * m[k]) / sd[k]) ** 2
        alpha[t], cd[t] = (a - 1) * np.sqrt(norm), np.sqrt(q)
        if inlier[t]:
            n += 1
            sa += alpha[t] * alpha[t]
            sb += q
    n = max(n, 1)
    return np.sqrt(sa / n), np.sqrt(sb / n)


@njit(cache=True)
def learn(
    sample: Image, gains: Floats, held: int, fewest: int, mean: Floats, sigma: Floats, s: Floats, b: Floats,
    valid: Bools, second: Floats, counts: Ints,
) -> None:  # fmt: skip
    """Train on a sample (K, H, W, 3) uint8 and write the model into the last seven arguments. Returns nothing.

    gains (K, 3): gain (brightness factor) of each frame and channel, by which grey levels are divided. held: number of
    frames in the shortest interval of a channel's grey levels, whose middle is the first guess of the mean. fewest:
    number of frames that are no inliers, from which on there is a second colour.

    Written: mean, sigma (H, W, 3), mean colour and its standard deviation in grey levels; s, b (H, W), normalisers of
    brightness and chromaticity distortion; valid (H, W), False where no background shows; second (H, W, 3), the second
    colour, nan where there is none. counts (2, 2, BINS): the values of valid pixels are added; first axis inliers or
    all frames of clean pixels, second axis normalised brightness or chromaticity distortion.
    """
    frames, high, wide, _ = sample.shape
    value, order = np.empty((frames, 3), np.float32), np.empty(frames, np.float32)
    every, inlier, outlier = np.ones(frames, np.bool_), np.empty(frames, np.bool_), np.empty(frames, np.bool_)
    alpha, cd = np.empty(frames), np.empty(frames)
    m, sd, other, other_sd = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for r in range(high):
        for c in range(wide):
            for k in range(3):
                second[r, c, k] = np.nan
                for t in range(frames):
                    value[t, k] = np.float32(sample[t, r, c, k]) / gains[t, k]
            guess(value, every, held, order, m, sd)
            good = max(sd[0], sd[1], sd[2]) <= WIDEST
            clean, found = inliers(value, m, sd, inlier)
            out = frames - found
            if out >= fewest:
                for t in range(frames):
                    outlier[t] = not inlier[t]
                guess(value, outlier, max(fewest, held * out // frames), order, other, other_sd)
                if max(other_sd[0], other_sd[1], other_sd[2]) <= WIDEST:
                    for k in range(3):
                        second[r, c, k] = other[k]
                    if inliers(value, other, other_sd, outlier)[1] > found:
                        for k in range(3):
                            second[r, c, k] = m[k]
                        clean = False
                        m, sd, inlier, other, other_sd, outlier = other, other_sd, outlier, m, sd, inlier
            sa, sb = distortions(value, m, sd, inlier, alpha, cd)
            noise = 3 * FLOOR / (sd[0] + sd[1] + sd[2])
            # s = a |E / sigma| (eq. 7) and b (eq. 8); of noise FLOOR alone s would be `noise`, and b sqrt(2) times it
            sa, sb = max(sa, noise), max(sb, np.sqrt(2.0) * noise)
            for k in range(3):
                mean[r, c, k], sigma[r, c, k] = m[k], sd[k]
            s[r, c], b[r, c], valid[r, c] = sa, sb, good
            if not good:
                continue
            for t in range(frames):
                # bins of (alpha - 1) / a (eq. 9) and CD / b (eq. 10)
                i = min(max(int((alpha[t] / sa + SPAN) / (2 * SPAN) * BINS), 0), BINS - 1)
                j = min(max(int((cd[t] / sb + SPAN) / (2 * SPAN) * BINS), 0), BINS - 1)
                counts[INLIERS, BRIGHTNESS, i] += inlier[t]
                counts[INLIERS, CHROMATICITY, j] += inlier[t]
                counts[CLEAN_PIXELS, BRIGHTNESS, i] += clean
                counts[CLEAN_PIXELS, CHROMATICITY, j] += clean
