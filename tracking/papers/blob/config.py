"""The parameters of `blob`, and its nominal filter at a frame rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings
from tracking.filters.track_uncertainty import Dynamics, check_birth


@dataclass(frozen=True)
class BlobConfig(BackgroundSettings):
    """The parameters of the tracker `blob`, with those of the background model; each field states default, range and
    unit.

    Lengths are metres at the person. They are noises, gates, association, confirmation, deletion, reporting, and, from
    pixels only, splitting of blobs. Raises InputError if a value is not allowed or foreground_time is shorter than
    background_time.
    """

    tracker: ClassVar[str] = "blob"

    accel_noise: float = param(
        0.5, (0.05, 10.0), "m/s^1.5", "white acceleration of the centre: root of its spectral density", "log"
    )
    size_accel_noise: float = param(
        0.1, (0.01, 5.0), "m/s^1.5", "white acceleration of height and width: root of its spectral density", "log"
    )
    position_noise: float = param(0.09, (0.005, 1.0), "m", "standard deviation of a measured centre", "log")
    size_noise: float = param(0.2, (0.005, 1.0), "m", "standard deviation of a measured height or width", "log")
    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a new track's velocity, per axis", "log")
    size_rate_prior: float = param(
        0.2, (0.01, 3.0), "m/s", "standard deviation of the rate of a new track's height and width", "log"
    )
    gate: float = param(
        0.999, (0.5, 0.999999), "probability", "share of a track's own measurements that its gate holds"
    )
    association: str = param(
        "optimal",
        ("nearest", "optimal"),
        "",
        "nearest: each measurement to its nearest gated track (the paper); optimal: least total cost (ours)",
        "categorical",
    )
    orphan_gate: float = param(
        0.9,
        (0.01, 0.999999),
        "probability",
        "as `gate`, of a track that is measured: an unassociated box inside this gate starts no track (ours)",
    )
    confirm_ratio: float = param(1.5, (1.01, 2.0), "", "a track is confirmed at or below this value of rho")
    confirm_gate: float = param(
        0.99,
        (0.1, 0.999999),
        "probability",
        "share of a track's own measurements that the gate of the confirming measurement holds",
    )
    coast_time: float = param(
        1.5, (0.0, 10.0), "s", "a confirmed track is deleted after this time without measurement, from the steady state"
    )
    tentative_time: float = param(
        1.0, (0.1, 10.0), "s", "a tentative track is deleted at this age, but not before it can be confirmed"
    )
    merged_time: float = param(
        3.0,
        (0.0, 20.0),
        "s",
        "replaces coast_time, if longer, for a track that is hidden or merged with others in one box; 0: boxes of "
        "several people are boxes like others (ours)",
    )
    score_start: float = param(0.5, (0.0, 1.0), "score", "least score of a detection that starts a track")
    score_continue: float = param(0.1, (0.0, 1.0), "score", "least score of a detection that updates a track (ours)")
    report_delay: float = param(
        0.1, (0.0, 5.0), "s", "a tentative track is reported from this age on, in frames in which it is measured (ours)"
    )
    report_coast: float = param(
        0.6,
        (0.0, 10.0),
        "s",
        "a confirmed track is reported for this time after its last measurement, from the steady state (ours)",
    )
    report_hidden: float = param(
        0.7,
        (0.0, 10.0),
        "s",
        "replaces report_coast, if longer, for a track that is hidden or merged with others in one box (ours)",
    )
    report_credit: float = param(
        0.33,
        (0.0, 10.0),
        "",
        "a missed track is reported for at most this share of the time in which it was measured (ours)",
    )

    split: bool = param(
        True,
        (True, False),
        "",
        "from pixels: people who share a blob are separated by templates (ours)",
        "categorical",
        sees="pixels",
    )
    evidence: float = param(
        10.0,
        (1.0, 500.0),
        "nats",
        "from pixels: log-likelihood of a template with full support; d^2 / 2 of its place is subtracted (ours)",
        "log",
        sees="pixels",
    )
    track_support: float = param(
        0.3,
        (0.02, 0.8),
        "share",
        "from pixels: least foreground share in the part of a confirmed track's template that no other covers (ours)",
        sees="pixels",
    )
    entry_support: float = param(
        0.5,
        (0.1, 0.9),
        "share",
        "from pixels: least support of the template of a new person or of a tentative track (ours)",
        sees="pixels",
    )
    person_noise: float = param(
        0.15,
        (0.01, 5.0),
        "m",
        "from pixels: standard deviation of people's sizes about the size expected at their place (ours)",
        "log",
        sees="pixels",
    )
    angle_noise: float = param(
        8.0,
        (0.5, 45.0),
        "deg",
        "from pixels: standard deviation of a measured direction, in addition to that of the blob's moments",
        "log",
        sees="pixels",
    )
    angle_rate: float = param(
        15.0,
        (0.5, 180.0),
        "deg/s^0.5",
        "from pixels: random walk of the direction: its standard deviation after one second",
        "log",
        sees="pixels",
    )
    most_foreground: float = param(
        0.6,
        (0.05, 1.0),
        "share",
        "from pixels: a frame with a larger share of foreground is not measured (ours)",
        sees="pixels",
    )

    def dynamics(self, fps: float) -> Dynamics:
        """Returns the nominal filter of the coordinates x, y, h, w (centre, height, width), lengths in m, at `fps`
        frames per s.

        The acceleration noises are roots of spectral densities, so sigma = noise / sqrt(dt) (ours): sigma is the
        standard deviation of the acceleration in a step, dt = 1 / fps s. Raises InputError if the first measurement of
        a new track would confirm it: its uncertainty rho at birth, relative to the steady state, is at or below
        confirm_ratio. If a step is longer than tentative_time, a new track has only this measurement to be confirmed
        by, so that it may.
        """
        root = np.sqrt(fps)
        accel, size = self.accel_noise * root, self.size_accel_noise * root
        made = Dynamics(
            1.0 / fps,
            np.array([accel, accel, size, size]),
            np.square([self.position_noise, self.position_noise, self.size_noise, self.size_noise]),
            np.square([self.speed_prior, self.speed_prior, self.size_rate_prior, self.size_rate_prior]),
        )
        if made.dt <= self.tentative_time:
            check_birth(made, self.confirm_ratio)
        return made
