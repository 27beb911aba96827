"""Robust training of the background model from a sample of frames; people may walk through the sample.

Input: a sample (K, H, W, 3) BGR uint8 of a still camera. Output: `Trained`. Equations: Horprasert et al. (2000). E,
sigma: mean colour and standard deviation of a pixel. alpha: its brightness in a frame over E's. CD: chromaticity
distortion, its colour's distance from the line through E in sigmas.

1. E and sigma of each pixel and colour channel (eqs 3, 4). The paper takes all frames; here the inliers only (ours).
   The first inliers are the shortest interval of grey levels that holds SHARE of the frames, in the channel in which
   the frames differ most: so all channels are those of the same frames. Then inliers, E and sigma are computed in turn
   until they settle. Of the other frames the same is done once more; the colour with more inliers is E, the other one
   is kept as the second colour. People who stand through most of the sample are E, and the ground is the second colour
   (tracking.detect.ghosts). A pixel whose first sigma is above WIDEST = 20 grey levels has no background (ours).
2. a_i and b_i of each pixel i: the RMS of alpha - 1 and of CD over the inliers (eqs 7, 8). a_i is kept as
   s_i = a_i sqrt(sum (E / sigma)^2), which is 1 for independent Gaussian noise and holds at any gain (ours). Neither is
   less than noise of FLOOR would give; sigma is at least FLOOR = 2 grey levels (ours).
3. Thresholds: quantiles of the normalised distortions at the detection rate (Gonzalez et al. 2006, Fig. 2), over
   pixels that were background in all frames of the sample; over all inliers if these pixels are too few. They are never
   tighter than those of Gaussian noise (ours).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from scenarios.errors import InputError
from sim.arrays import read_only
from sim.types import Bools, Image, Ints
from tracking.detect import background_training_kernels as kernels
from tracking.detect.background_kernels import Floats
from tracking.detect.background_training_kernels import BINS, SPAN
from tracking.detect.brightness_gain import frame_gains

LEAST_FRAMES = 10  # Fewest frames of a sample: SHARE of fewer frames are too few values for a standard deviation.
# Share of the frames in which the background must be visible; a thing at rest in so many frames may replace it.
SHARE = 0.35
# Least share of the frames that are no inliers, where there is a second colour; people who walk cover a pixel for less.
SECOND_SHARE = 0.1
# Thresholds are taken from the clean pixels if these have at least this share of the values of all inliers.
FEWEST_CLEAN = 0.05


@dataclass(frozen=True)
class Trained:
    """The trained background model of an image of H x W px.

    mean, sigma (H, W, 3): mean colour E at gain 1, and its standard deviation, BGR grey levels. s, b (H, W):
    normalisers of brightness and of chromaticity distortion CD, no unit. valid (H, W): False where the sample shows no
    background; there the other arrays have no meaning. second (H, W, 3): the colour, at gain 1, of a cluster of frames
    that are no inliers, nan if there is none. thresholds: of CD / b, then lower and upper of (alpha - 1) / a, alpha the
    brightness over E's, a = s / |E / sigma|. counts (2, BINS = 4000): histograms over [-SPAN, SPAN], SPAN = 20, of the
    normalised brightness (row 0) and chromaticity distortions (row 1), from which thresholds for another detection rate
    can be computed.
    """

    mean: Floats
    sigma: Floats
    s: Floats
    b: Floats
    valid: Bools
    second: Floats
    thresholds: tuple[float, float, float]
    counts: Ints


def train(sample: Image, rate: float, follow_gain: bool) -> Trained:
    """Returns the background model of a sample of frames (K, H, W, 3) BGR uint8. rate: detection rate of the
    thresholds; follow_gain: True estimates the brightness of each frame first. Raises InputError for a bad sample."""
    check(sample)
    sample = read_only(sample.view())  # of one type, so that numba compiles once
    gains = frame_gains(sample) if follow_gain else np.ones((len(sample), 3), np.float32)
    size = sample.shape[1:3]
    mean, sigma = np.empty((*size, 3), np.float32), np.empty((*size, 3), np.float32)
    s, b, valid = np.empty(size, np.float32), np.empty(size, np.float32), np.empty(size, bool)
    second, counts = np.empty((*size, 3), np.float32), np.zeros((2, 2, BINS), np.int64)
    held = max(int(np.ceil(SHARE * len(sample))), 3)
    fewest = max(int(np.ceil(SECOND_SHARE * len(sample))), 3)
    kernels.learn(sample, gains, held, fewest, mean, sigma, s, b, valid, second, counts)
    if valid.mean() < 0.5:
        got = f"{1 - valid.mean():.0%} of the pixels never keep one colour in {len(sample)} frames"
        expected = "a still camera; from this sample no background can be learned"
        remedy = "give a sample of the empty scene, or detections instead of pixels"
        raise InputError(place="background", got=got, expected=expected, remedy=remedy)
    clean, inliers = (counts[which, kernels.CHROMATICITY].sum() for which in (kernels.CLEAN_PIXELS, kernels.INLIERS))
    counts = counts[kernels.CLEAN_PIXELS if clean >= FEWEST_CLEAN * inliers else kernels.INLIERS].copy()
    return Trained(mean, sigma, s, b, valid, second, thresholds(counts, rate), counts)


def check(sample: Image) -> None:
    """Raises InputError unless the sample is (K, H, W, 3) uint8 with H, W above 0 and K at least LEAST_FRAMES = 10
    frames."""
    shape, kind = np.shape(sample), getattr(sample, "dtype", None)
    if kind != np.uint8 or len(shape) != 4 or shape[-1] != 3 or 0 in shape[1:3] or shape[0] < LEAST_FRAMES:
        expected = f"(K, H, W, 3) of uint8, BGR, at least {LEAST_FRAMES} frames"
        remedy = "give a longer sample, of 8-bit colour"
        raise InputError(place="background", got=f"{shape} of {kind}", expected=expected, remedy=remedy)


def check_frame(image: Image, size: tuple[int, ...]) -> None:
    """Raises InputError unless a frame is a uint8 array of shape (H, W, 3)."""
    if image.dtype != np.uint8 or image.shape != (*size, 3):
        got, expected = f"{image.shape} of {image.dtype}", f"{(*size, 3)} of uint8, as the background sample"
        raise InputError(place="frame", got=got, expected=expected, remedy="give 8-bit colour frames of one size")


def thresholds(counts: Ints, rate: float) -> tuple[float, float, float]:
    """Returns 3 thresholds at a detection rate: of CD / b, lower of (alpha - 1) / a (below 0), upper of (alpha - 1) /
    a."""
    edges = np.linspace(-SPAN, SPAN, BINS + 1)
    shares = [np.concatenate([[0], np.cumsum(c)]) / max(c.sum(), 1) for c in counts]
    low, high, most = (
        float(np.interp(p, shares[which], edges))
        for p, which in ((1 - rate, kernels.BRIGHTNESS), (rate, kernels.BRIGHTNESS), (rate, kernels.CHROMATICITY))
    )
    normal = NormalDist().inv_cdf(rate)
    return max(most, math.sqrt(-math.log(1 - rate))), min(low, -normal), max(high, normal)
