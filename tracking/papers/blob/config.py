"""The parameters of `blob`, and its nominal filter at a frame rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings
from tracking.filters.track_uncertainty import Dynamics

SIZE_RATE_PRIOR = 0.2  # m/s: standard deviation of the rate of a new track's height and width.
CONFIRM_GATE = 0.99  # Share of a track's own measurements that the gate of the confirming measurement holds.


@dataclass(frozen=True)
class BlobConfig(BackgroundSettings):
    """The parameters of the tracker `blob`, with those of the background model; lengths are metres at the person.

    Raises InputError if a value is not allowed.
    """

    tracker: ClassVar[str] = "blob"

    # fmt: off
    accel_noise: float = param(0.3, (0.05, 10.0), "m/s^1.5",
        "white acceleration of the centre: root of its spectral density", "log")
    size_accel_noise: float = param(0.1, (0.01, 5.0), "m/s^1.5",
        "white acceleration of height and width: root of its spectral density", "log")
    position_noise: float = param(0.12, (0.005, 1.0), "m", "standard deviation of a measured centre", "log")
    size_noise: float = param(0.25, (0.005, 1.0), "m", "standard deviation of a measured height or width", "log")
    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a new track's velocity, per axis", "log")
    gate: float = param(0.999, (0.5, 0.999999), "probability",
        "share of a track's own measurements that its gate holds")
    management: str = param("existence", ("rho", "existence"), "",
        "rho: nearest gated track, and tracks managed by rho (the paper); existence: by probabilities (ours)",
        "categorical", online=False)
    detect_prob: float = param(0.9, (0.1, 0.999), "probability",
        "existence: a person who can be detected is detected in a frame")
    hidden_time: float = param(0.5, (0.05, 10.0), "s",
        "existence: mean time in which a person cannot be detected", "log")
    clutter_rate: float = param(0.5, (0.001, 100.0), "1/frame", "existence: new false boxes", "log")
    confirm_ratio: float = param(1.5, (1.01, 2.0), "", "rho: a track is confirmed at or below this value of rho")
    coast_time: float = param(1.5, (0.0, 10.0), "s",
        "rho: a confirmed track is deleted after this time without measurement, from the steady state")
    tentative_time: float = param(1.0, (0.1, 10.0), "s",
        "rho: a tentative track is deleted at this age, but not before it can be confirmed")
    split: bool = param(True, (True, False), "",
        "from pixels: people who share a blob are separated by templates (ours)", "categorical", sees="pixels")
    # fmt: on

    def dynamics(self, fps: float) -> Dynamics:
        """Returns the nominal filter of x, y, h, w (centre, height, width; m) at `fps` frames per s."""
        # Acceleration noises are roots of spectral densities, so that a step has sigma = noise / sqrt(dt) (ours).
        root = np.sqrt(fps)
        accel, size = self.accel_noise * root, self.size_accel_noise * root
        return Dynamics(
            1.0 / fps,
            np.array([accel, accel, size, size]),
            np.square([self.position_noise, self.position_noise, self.size_noise, self.size_noise]),
            np.square([self.speed_prior, self.speed_prior, SIZE_RATE_PRIOR, SIZE_RATE_PRIOR]),
        )
