"""Says once what is wrong with pictures from which people cannot be measured (ours).

Two things are counted: frames that are mostly foreground, in which nothing is measured, and frames with more pieces of
foreground than are looked at. A warning follows if OFTEN of at least FEWEST frames are so.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

from tracking.detect.background_kernels import Floats

FEWEST, OFTEN = 20, 0.25  # frames, and the share of them from which the pictures are wrong
NOISY = 8.0  # grey levels: standard deviation of the noise from which it is named as the cause

LIKE_NOISE = "the pictures are noisy (standard deviation {:.0f} grey levels); give more light, or less compression"
LIKE_MOTION = "the light changes often, the camera moves, or leaves or water do; give a still camera, or --mask"


class PictureCheck:
    """State: frames, mostly_foreground, too_many: numbers of frames so far; said: True after the warning."""

    def __init__(self) -> None:
        self.frames, self.mostly_foreground, self.too_many, self.said = 0, 0, 0, False

    def add(self, plausible: bool, complete: bool, noise: Callable[[], Floats]) -> None:
        """Counts a frame, and warns if it is one too many.

        plausible: False if it is mostly foreground; complete: False if pieces of foreground were left out. noise:
        returns the standard deviation (3,) of each channel, grey levels.
        """
        self.frames += 1
        self.mostly_foreground += not plausible
        self.too_many += not complete
        most = max(self.mostly_foreground, self.too_many)
        if self.said or self.frames < FEWEST or most < OFTEN * self.frames:
            return
        self.said = True
        what = "are mostly foreground: nothing is measured in them"
        if self.too_many == most:
            what = "have more pieces of foreground than are looked at: the smaller ones are left out"
        level = float(noise().max())
        cause = LIKE_NOISE.format(level) if level >= NOISY else LIKE_MOTION
        warnings.warn(f"{most} of the first {self.frames} pictures {what}. Cause: {cause}", UserWarning, stacklevel=2)
