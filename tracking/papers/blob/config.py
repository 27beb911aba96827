"""The parameters of `blob`, and the nominal filter that follows from them at a frame rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings
from tracking.filters.track_uncertainty import Dynamics, check_birth


@dataclass(frozen=True)
class BlobConfig(BackgroundSettings):
    """Gates, noises, association, management and output of `blob`. Lengths are metres at the person."""

    tracker: ClassVar[str] = "blob"

    accel_noise: float = param(0.5, (0.05, 10.0), "m/s^1.5", "white acceleration of the centre, per root second", "log")
    size_accel_noise: float = param(0.1, (0.01, 5.0), "m/s^1.5", "white acceleration of height and width", "log")
    position_noise: float = param(0.09, (0.005, 1.0), "m", "standard deviation of a measured centre", "log")
    size_noise: float = param(0.2, (0.005, 1.0), "m", "standard deviation of a measured height or width", "log")
    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a newborn's velocity", "log")
    size_rate_prior: float = param(0.2, (0.01, 3.0), "m/s", "standard deviation of a newborn's growth", "log")
    gate: float = param(0.999, (0.5, 0.999999), "probability", "share of true measurements inside a track's gate")
    association: str = param(
        "optimal",
        ("nearest", "optimal"),
        "",
        "nearest gated track (the paper) or least total cost (ours)",
        "categorical",
    )
    orphan_gate: float = param(
        0.9,
        (0.01, 0.999999),
        "probability",
        "gate of a measured track within which a measurement left over starts none (ours)",
    )
    confirm_ratio: float = param(1.5, (1.01, 2.0), "", "rho at or below which a track is confirmed")
    confirm_gate: float = param(0.99, (0.1, 0.999999), "probability", "gate of the confirming measurement")
    coast_time: float = param(
        1.5, (0.0, 10.0), "s", "a confirmed track dies after so long without measurement, from the steady state"
    )
    tentative_time: float = param(
        1.0, (0.1, 10.0), "s", "a tentative track not confirmed by then dies, but not before it could be"
    )
    merged_time: float = param(
        3.0, (0.0, 20.0), "s", "the same once another track, or a merged blob, explained that it is not seen"
    )
    score_start: float = param(0.5, (0.0, 1.0), "score", "least score of a detection that starts a track")
    score_continue: float = param(0.1, (0.0, 1.0), "score", "least score of a detection that continues one")
    report_delay: float = param(
        0.1, (0.0, 5.0), "s", "a tentative track is reported, where it is measured, from this age on"
    )
    report_coast: float = param(
        0.6, (0.0, 10.0), "s", "a track is reported so long after its last measurement, from the steady state"
    )
    report_hidden: float = param(0.7, (0.0, 10.0), "s", "the same once it was hidden or merged", before=0.0)
    report_credit: float = param(
        0.33,
        (0.0, 10.0),
        "",
        "an unseen track is reported no longer than this share of the time it was seen",
        before=1.0,
    )

    segmentation: str = param(
        "horprasert",
        ("horprasert", "mog2"),
        "",
        "from pixels: five classes (the paper's), or OpenCV's mixture of Gaussians",
        "categorical",
        online=False,
        before="horprasert",
        sees="pixels",
    )
    split: bool = param(
        True,
        (True, False),
        "",
        "from pixels: people who share a blob are told apart (ours)",
        "categorical",
        before=True,
        sees="pixels",
    )
    evidence: float = param(
        10.0,
        (1.0, 500.0),
        "nats",
        "what a wholly seen template is worth beside its distance (ours)",
        "log",
        before=10.0,
        sees="pixels",
    )
    track_support: float = param(
        0.3,
        (0.02, 0.8),
        "share",
        "foreground in what no other covers of a confirmed track measured (ours)",
        before=0.3,
        sees="pixels",
    )
    entry_support: float = param(
        0.5, (0.1, 0.9), "share", "support from which on a template is somebody new (ours)", before=0.5, sees="pixels"
    )
    person_noise: float = param(
        0.15,
        (0.01, 5.0),
        "m",
        "how far people's axes are from those expected at their place (ours)",
        "log",
        before=0.15,
        sees="pixels",
    )
    angle_noise: float = param(
        8.0,
        (0.5, 45.0),
        "deg",
        "standard deviation of a measured direction, beside the moments' own",
        "log",
        before=8.0,
        sees="pixels",
    )
    angle_rate: float = param(
        15.0,
        (0.5, 180.0),
        "deg/s^0.5",
        "random walk of the direction, per root second",
        "log",
        before=15.0,
        sees="pixels",
    )
    most_foreground: float = param(
        0.6,
        (0.05, 1.0),
        "share",
        "a frame with more foreground tells nothing: lights, camera (ours)",
        before=0.6,
        sees="pixels",
    )

    def dynamics(self, fps: float) -> Dynamics:
        """The nominal filter of (x, y, h, w): Q, R and a newborn's P. Accelerations are spectral densities, so
        sigma = noise / sqrt(dt)."""
        root = np.sqrt(fps)
        accel, size = self.accel_noise * root, self.size_accel_noise * root
        made = Dynamics(
            1.0 / fps,
            np.array([accel, accel, size, size]),
            np.square([self.position_noise, self.position_noise, self.size_noise, self.size_noise]),
            np.square([self.speed_prior, self.speed_prior, self.size_rate_prior, self.size_rate_prior]),
        )
        check_birth(made, self.confirm_ratio)
        return made
