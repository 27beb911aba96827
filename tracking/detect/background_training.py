"""Robust training of the background model from a sample of frames that people may walk through.

Equations are those of Horprasert et al. (2000). Per pixel and colour: the shortest interval that holds SHARE of the
values finds the inliers; E and sigma are their mean and standard deviation (eqs 3, 4, of all frames there), in turn,
until they settle. (The median and MAD of a pixel where people stand about half of the time lie between them and the
ground, with a sigma that hides both.)
Per pixel: a_i and b_i are the RMS of alpha - 1 and of CD over the inliers (eqs 7, 8). a_i is kept as
s_i = a_i sqrt(sum (E/sigma)^2), which is 1 for independent Gaussian noise and stays true when the gain changes.
Thresholds: quantiles of the normalised distortions at the detection rate (the paper's Fig. 2), over the pixels that
nobody covered in any frame of the sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from scenarios.errors import InputError
from sim.types import Bools, Image, Ints
from tracking.detect.brightness_gain import frame_gains
from tracking.detect.pixel_classes import Floats

LEAST_FRAMES = 10
"""With fewer, SHARE of them are too few values to tell a spread by."""
FLOOR = 2.0
"""Grey levels: least sigma, and least noise that the normalisers stand for. Compressed pictures rest and then
jump by a level or two; with less, the thresholds stand for these jumps (OpenCV's MOG2 has 2, too)."""
INLIER = 3.5
"""Robust sigmas within which a sample is background, for E, sigma and the normalisers."""
SHARE = 0.35
"""Of the sample: the ground must show as often as this to be found; else whatever rests so often is taken for it."""
AS_SIGMA = 2.2
"""Standard deviations of a Gaussian per half length of the interval about its mean that holds SHARE."""
ROUNDS = 10
"""At most; the inliers settle after three or four."""
CLEAN = 6.0
"""As INLIER, for thresholds, where the tail counts: a pixel with any value beyond was covered; it is left out whole."""
WIDEST = 20.0
"""Grey levels: a pixel whose shortest interval is wider than this sigma's shows no background."""
BINS, SPAN = 4000, 20.0
"""Of the histograms: bins from -SPAN to SPAN, so wide that thresholds lie within; what is beyond counts at the ends."""


@dataclass(frozen=True)
class Trained:
    """E, sigma (H, W, 3), grey levels; s, b (H, W), no unit; valid (H, W); thresholds of CD / b, of (alpha - 1) / a
    the lower and the upper one; counts (2, BINS): the histograms that these are read off."""

    mean: Floats
    sigma: Floats
    s: Floats
    b: Floats
    valid: Bools
    thresholds: tuple[float, float, float]
    counts: Ints


def train(sample: Image, rate: float, follow_gain: bool) -> Trained:
    """The model of a sample (K, H, W, 3); InputError where it is none, too short, or without background."""
    from tracking.detect import background_training_kernels

    check(sample)
    gains = frame_gains(sample) if follow_gain else np.ones((len(sample), 3), np.float32)
    size = sample.shape[1:3]
    mean, sigma = np.empty((*size, 3), np.float32), np.empty((*size, 3), np.float32)
    s, b, valid = np.empty(size, np.float32), np.empty(size, np.float32), np.empty(size, bool)
    counts = np.zeros((2, 2, BINS), np.int64)
    held = max(int(np.ceil(SHARE * len(sample))), 3)
    rules = AS_SIGMA, FLOOR, WIDEST, INLIER, CLEAN, ROUNDS
    background_training_kernels.learn(sample, gains, held, rules, (BINS, SPAN), mean, sigma, s, b, valid, counts)
    if valid.mean() < 0.5:
        raise InputError(
            place="background",
            got=f"{1 - valid.mean():.0%} of the pixels never rest in {len(sample)} frames",
            expected="a still camera: no background can be had",
            remedy="give a sample of the empty scene, or detections instead of pixels",
        )
    enough = counts[1, 1].sum() >= 0.05 * counts[0, 1].sum()
    counts = counts[1 if enough else 0].copy()
    return Trained(mean, sigma, s, b, valid, thresholds(counts, rate), counts)


def check(sample: Image) -> None:
    """InputError unless this is a sample of colour frames, enough of them."""
    shape, kind = np.shape(sample), getattr(sample, "dtype", None)
    expected, remedy = "", ""
    if kind != np.uint8 or len(shape) != 4 or shape[-1] != 3 or 0 in shape[1:3]:
        expected, remedy = "(K, H, W, 3) of uint8, BGR", "convert the frames to 8-bit colour"
    elif shape[0] < LEAST_FRAMES:
        expected, remedy = f"at least {LEAST_FRAMES} frames", "give a longer sample"
    if expected:
        raise InputError(place="background", got=f"{shape} of {kind}", expected=expected, remedy=remedy)


def check_frame(image: Image, size: tuple[int, ...]) -> None:
    """InputError unless a frame is of the kind and size (H, W) of the sample."""
    if image.dtype != np.uint8 or image.shape != (*size, 3):
        raise InputError(
            place="frame",
            got=f"{image.shape} of {image.dtype}",
            expected=f"{(*size, 3)} of uint8, as the background sample",
            remedy="give frames of one size and kind",
        )


def thresholds(counts: Ints, rate: float) -> tuple[float, float, float]:
    """CD, lower, upper at the detection rate, from histograms (brightness, CD) over -SPAN..SPAN.

    None is nearer than Gaussian noise of unit RMS would have it: a still picture has no tails. Such brightness is
    normal; CD^2 is then chi2 of 2 degrees of freedom over its mean 2, so that P(CD > t) = exp(-t^2).
    """
    edges = np.linspace(-SPAN, SPAN, BINS + 1)
    shares = [np.concatenate([[0], np.cumsum(c)]) / max(c.sum(), 1) for c in counts]
    low, high, most = (
        float(np.interp(p, share, edges)) for p, share in ((1 - rate, shares[0]), (rate, shares[0]), (rate, shares[1]))
    )
    normal = NormalDist().inv_cdf(rate)
    return max(most, math.sqrt(-math.log(1 - rate))), min(low, -normal), max(high, normal)
