"""Colour background subtraction into five classes (Horprasert, Harwood, Davis 2000; Gonzalez et al. 2006, section 3).

Each pixel i has a mean colour E_i and standard deviations sigma_i. A colour I is compared with the line through E_i:
    alpha = argmin |(I - alpha E) / sigma|    brightness distortion      (Horprasert et al., eq. 5)
    CD    = |(I - alpha E) / sigma|           chromaticity distortion    (eq. 6)
Both are divided by their RMS over the training sample, so that one threshold serves the whole image:
    (alpha - 1) / a_i  (eqs 7, 9),   CD / b_i  (eqs 8, 10)
Classes, tested in the order of Gonzalez et al., sec. 3.2:
    1. CD / b above its threshold: foreground
    2. (alpha - 1) / a below the lower threshold and alpha below `dark`: dark foreground
    3. (alpha - 1) / a above the upper threshold: highlight; if the model adapts, foreground where alpha is above
       BRIGHT (ours)
    4. (alpha - 1) / a below the lower threshold: shadow
    5. otherwise: background
Eqs 5, 6, 9, 10 are in background_kernels, eqs 3, 4, 7, 8 in background_training_kernels.

Departures (ours; those of the training: background_training). `dark` is a limit of alpha instead of a normalised
threshold, and a pixel within the noise is never dark foreground. BRIGHT is a limit of alpha, too. Unless the settings
say "trained", the model adapts, follows the gain of each frame, and takes the darkest shadow of the sample in place of
`dark` (shadow_depth). If all frames of the sample are grey (R = G = B), and no shadows are found, every pixel beyond
the brightness thresholds is foreground, dark foreground if it is darker.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from sim.types import Array, Bools, Image
from tracking.detect import background_kernels as kernels
from tracking.detect import brightness_gain
from tracking.detect.background_kernels import BACKGROUND as BACKGROUND
from tracking.detect.background_kernels import DARK as DARK
from tracking.detect.background_kernels import FOREGROUND as FOREGROUND
from tracking.detect.background_kernels import HIGHLIGHT as HIGHLIGHT
from tracking.detect.background_kernels import SHADOW as SHADOW
from tracking.detect.background_kernels import Floats
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.background_training import check_frame, thresholds, train
from tracking.detect.background_training_kernels import FLOOR
from tracking.detect.mosaic import Mosaic
from tracking.detect.shadow_depth import BINS, SAMPLED, darkest_shadow
from tracking.detect.shadow_depth_kernels import count_even

# Relative brightness above which a brightened pixel is foreground, not highlight (ours). Light shirts are 15 to 30 %
# brighter than a grey floor; at 1.3 a third of their pixels are missed.
BRIGHT = 1.15
FOREGROUND_SLOWER = 10.0  # Foreground pixels adapt so many times more slowly than background pixels (ours).
INTERLEAVE = 4  # Each frame adapts every fourth row, with the rate of four frames; four frames adapt all rows.


class Background:
    """The background model of a still camera, H x W px; colours are BGR.

    State, float32 unless noted:
        mean (3, H, W)        E: mean of each colour channel at gain 1, grey levels, 1 or more; changed by `adapt`
        var (3, H, W)         variance of each channel in the image, squared grey levels; changed by `adapt`
        second (3, H, W)      the second colour of a pixel in the sample, at gain 1; nan if there is none
        gain (3,)             brightness of the last classified frame relative to `mean`, 1 at first; set by `classify`
        s, b (H, W)           normalisers, no unit: of brightness (s = a |E / sigma|, sigma^2 the variance) and of
                              chromaticity distortion CD (distance from the line through E); inf where `valid` is False
        valid (H, W)          bool; False where the sample showed no background: classified as BACKGROUND always
        thresholds            3 numbers: of CD / b, lower of (alpha - 1) / a, upper of (alpha - 1) / a
        bounds                2 limits of alpha (pixel brightness over the model's): of pixels beyond the thresholds
                              those darker than the first are dark foreground, not shadow, those brighter than the
                              second are foreground, not highlight; (1, 1) if the sample is grey without shadows
        settings, fps         the BackgroundSettings in use; frames per second
    """

    def __init__(self, sample: Image, fps: float, settings: BackgroundSettings | None = None) -> None:
        """Trains the model on a sample of frames (K, H, W, 3) BGR uint8.

        fps: frames per second, for the time constants of `adapt`. settings: None stands for the defaults.

        Raises InputError if the sample has a wrong shape or dtype, fewer than 10 frames, or if fewer than half of its
        pixels show a background.
        """
        self.settings = settings or BackgroundSettings()
        self.fps = fps
        trained = train(sample, self.settings.detection_rate, self.settings.adaptive)
        self.mean: Floats = np.ascontiguousarray(np.moveaxis(trained.mean, -1, 0))
        self.var: Floats = np.ascontiguousarray(np.moveaxis(np.square(trained.sigma), -1, 0))
        self.second: Floats = np.ascontiguousarray(np.moveaxis(trained.second, -1, 0))
        self.valid = trained.valid
        self.s, self.b = (np.where(self.valid, n, np.float32(np.inf)) for n in (trained.s, trained.b))
        self._counts = trained.counts
        self.gain: Floats = np.ones(3, np.float32)
        self._grid = brightness_gain.grid(*self.valid.shape)
        self._grid_background = self.valid[self._grid]
        self._first_row = 0
        self._whole: Mosaic | None = None
        self._grey = bool((sample[..., :1] == sample).all())
        self._darkened = np.zeros(BINS, np.int64)
        self.follow(self.settings)
        if self.settings.adaptive:
            self._learn_shadows(sample)

    def follow(self, settings: BackgroundSettings) -> None:
        """Replaces the settings: thresholds and limits of brightness are computed anew, mean, variance and gain stay as
        learned.
        """
        self.settings = settings
        self.thresholds = thresholds(self._counts, settings.detection_rate)
        bright = BRIGHT if settings.adaptive else math.inf
        unknown = (1.0, 1.0) if self._grey else (settings.dark, bright)
        shadows = darkest_shadow(self._darkened, settings.dark) if settings.adaptive else None
        self.bounds = unknown if shadows is None else (shadows, bright)

    def classify(self, image: Image, shown: Bools | None = None) -> Image:
        """Returns the class of each pixel of a frame (H, W, 3) BGR uint8, as (H, W) uint8.

        shown (H, W): False where the frame shows nothing, which is BACKGROUND; None: True everywhere.

        The classes: 0 BACKGROUND, 1 FOREGROUND, 2 DARK (dark foreground), 3 SHADOW, 4 HIGHLIGHT. A pixel whose `valid`
        is False is always BACKGROUND. An adaptive model estimates its `gain` first; mean and variance do not change.

        Raises InputError if the frame's size or dtype is not the sample's.
        """
        check_frame(image, self.valid.shape)
        if self.settings.adaptive:
            self.gain = self._estimate_gain(image, self.valid if shown is None else self.valid & shown)
        limits = np.array([*self.thresholds, *self.bounds], np.float32)
        classes = np.empty(self.valid.shape, np.uint8)
        one, two, three = (plane.ravel() for plane in colour_planes(image))
        E, V = self.mean.reshape(3, -1), self.var.reshape(3, -1)
        kernels.classify(one, two, three, E, V, self.s.ravel(), self.b.ravel(), self.gain, limits, classes.reshape(-1))
        if shown is not None:
            classes[~shown] = BACKGROUND
        self._grid_background = ~fused_foreground(classes[self._grid]) & self.valid[self._grid]
        return classes

    def adapt(self, image: Image, classes: Image, protected: Bools | None = None) -> None:
        """Changes the model's mean and variance in place towards a frame (H, W, 3) BGR uint8.

        classes (H, W): the result of the last `classify`, which must have been of this frame, as it set the gain.
        BACKGROUND pixels move with the time constant background_time (s), the mean of all others FOREGROUND_SLOWER
        times as slowly. The mean stays at 1 or above, the variance at 4 squared grey levels or above. A colour channel
        at 255 does not count where the model expects 255 or more. Pixels where `protected` (H, W) is True do not
        change. Each call changes every fourth row only. A model that is not adaptive does not change.

        Raises InputError if the frame's size or dtype is not the sample's.
        """
        check_frame(image, self.valid.shape)
        keep = np.zeros(self.valid.shape, bool) if protected is None else protected
        if not self.settings.adaptive:
            return
        time = self.settings.background_time
        fast, slow = (1 - math.exp(-INTERLEAVE / (self.fps * t)) for t in (time, FOREGROUND_SLOWER * time))
        first, self._first_row = self._first_row, (self._first_row + 1) % INTERLEAVE
        rows = slice(first, None, INTERLEAVE)
        still, background = keep[rows], classes[rows] == BACKGROUND
        kernels.adapt(
            colour_planes(image[rows]), still, background, self.mean, self.var, self.gain, first, INTERLEAVE, fast,
            slow, FLOOR**2,
        )  # fmt: skip

    def noise(self) -> Floats:
        """Returns the standard deviation (3,) of the camera's noise, grey levels: the median over the image."""
        return np.asarray(np.sqrt(np.median(self.var[:, self.valid], axis=1)), np.float32)

    def mend(self, where: Bools, colour: Floats) -> None:
        """Replaces the model at the pixels `where` (H, W): mean from `colour` (3, H, W), at gain 1, noise as elsewhere.
        Variance and normalisers were those of something else, so they become the medians over the image."""
        self.mean[:, where] = np.maximum(colour[:, where], 1.0)
        self.var[:, where] = np.square(self.noise())[:, None]
        self.s[where], self.b[where] = np.median(self.s[self.valid]), np.median(self.b[self.valid])
        self.valid[where] = True

    def _learn_shadows(self, sample: Image) -> None:
        s = np.where(self.valid, self.s, np.float32(1))
        for image in sample[:: max(len(sample) // SAMPLED, 1)]:
            classes = self.classify(image)
            count_even(colour_planes(image), classes, self.mean, self.var, s, self.gain, self._darkened)
        self.gain, self._grid_background = np.ones(3, np.float32), self.valid[self._grid]
        self.follow(self.settings)

    def look_at(self, at: tuple[int, int], size: tuple[int, int]) -> None:
        """Makes a window of the model, of `size` (width, height) px, its image; the rest waits for `carry`.

        at: left and top of the window, px."""
        self._whole = Mosaic(*self._planes(), at, size)
        self._take_window()

    def begin_anew(self, colour: Floats) -> None:
        """Takes `colour` (3, H, W), at gain 1, as the background, and forgets what lies beside the image."""
        self.mend(np.ones(self.valid.shape, bool), colour)
        self._whole = None

    def carry(self, step: Array, whole: bool) -> None:
        """Moves the model in its image by a homography `step` (3, 3), px; what comes into view for the first time
        becomes not `valid`.

        whole: the step is a shift by whole px, so that no colour is interpolated.
        """
        planes, known = self._planes()
        if self._whole is None:
            self._whole = Mosaic(planes, known, (0, 0), self.valid.shape[::-1])
        else:
            self._whole.store(planes, known)
        if whole:
            right, down = np.rint(step[:2, 2]).astype(int).tolist()
            self._whole.move(-right, -down)
        else:
            self._whole.bend(step)
        self._take_window()

    def _planes(self) -> tuple[Floats, Bools]:
        middle = np.median(self.s[self.valid]), np.median(self.b[self.valid])
        s, b = (np.where(self.valid, n, m) for n, m in zip((self.s, self.b), middle, strict=True))
        return np.concatenate([self.mean, self.var, s[None], b[None]]).astype(np.float32), self.valid

    def _take_window(self) -> None:
        assert self._whole is not None
        planes, self.valid = self._whole.window()
        self.mean, self.var = (np.ascontiguousarray(planes[k : k + 3]) for k in (0, 3))
        self.s, self.b = (np.where(self.valid, n, np.float32(np.inf)) for n in planes[6:])
        self._grid = brightness_gain.grid(*self.valid.shape)
        self._grid_background = self.valid[self._grid]

    def picture(self) -> Image:
        """Returns the empty scene (H, W, 3) BGR uint8 in the brightness of the last frame."""
        return np.asarray(np.clip(np.moveaxis(self.mean * self.gain[:, None, None], 0, -1) + 0.5, 0, 255), np.uint8)

    def _estimate_gain(self, image: Image, known: Bools) -> Floats:
        seen = np.moveaxis(image[self._grid], -1, 0).astype(np.float32)
        mean, known = self.mean[:, *self._grid], known[self._grid]
        found = brightness_gain.gain(seen, mean, self._grid_background & known)
        if found is None:
            found = brightness_gain.gain(seen, mean, known)
        return self.gain if found is None else found


def colour_planes(image: Image) -> tuple[Image, ...]:
    """Returns the three colour planes (H, W) of an image (H, W, 3), contiguous."""
    return tuple(np.asarray(plane, np.uint8) for plane in cv2.split(image))


def fused_foreground(classes: Image) -> Bools:
    """Returns True where the class is FOREGROUND or DARK (dark foreground), False for the others (Gonzalez et al., sec.
    3.3)."""
    return np.asarray((classes == FOREGROUND) | (classes == DARK))
