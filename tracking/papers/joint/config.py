"""The parameters of `joint`. Lengths are metres; in the image positions are divided by px per m.

The weights of the event classifier are the file event_classifier.toml of this folder, which `flockscope fit joint`
writes; it names the command, the seeds and the scores of the fit.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from sim.types import Array
from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings

FITTED: dict[str, list[float]] = tomllib.loads(
    Path(__file__).with_name("event_classifier.toml").read_text(encoding="utf-8")
)["params"]
CLUTTER_DENSITY = 0.002  # 1/m^2: false alarms per frame (ours).
BIRTH_DENSITY = 0.003  # 1/(m^2 s): new people (ours).
# Existence probabilities from which a new person is tracked, and a tracked one reported (ours).
CONFIRMED, REPORTED = 0.9, 0.5
LEAST_PRESENCE = 0.02  # Who is less probably still there, as a person or a false alarm, is removed (ours).
SPEED_PRIOR = 1.3  # m/s: standard deviation of a new person's velocity, per axis, that of walking people (ours).
# m: s_0, prior scatter of a cluster, as of one person more, and D_0, distance of a virtual other cluster (ours).
SCATTER, APART = 0.5, 2.0
SIZE_MEAN, SIZE_STD = 1.0, 1.5  # mu and sigma of the prior over group sizes, people.
EVENT_TIME = 0.1  # s between the two times of the features for which the event classifier is fitted (ours).
ALPHA = 0.5  # Share of the dynamics in the individuals' proposal; the paper does not print it.
VALIDITY_RATE = 60.0  # 1/s: lambda_cl, weight of the cluster validity in p(Z | X); not printed, fitted.
SHARPNESS = 8.0  # Weight of the validity in the choice of parts of a split, and of a new person's group (ours).


def _weights(event: str) -> Any:
    meaning = f"{event}: weights of log(1 + d_KL), d_v, d_intra, at the earlier, then the later time; constant"
    return param(tuple(FITTED[f"{event}_weights"]), (-100.0, 100.0), "", meaning, "vector")


@dataclass(frozen=True)
class JointConfig(BackgroundSettings):
    """The parameters of the tracker `joint`, with those of the background model.

    Raises InputError if a value is not allowed.
    """

    tracker: ClassVar[str] = "joint"

    # fmt: off
    particles: int = param(50, (1, 2000), "particles",
        "N_x, particles of individuals", "int", online=False, tunable=False)
    partitions: int = param(50, (1, 500), "particles",
        "N_z, partitions under each particle", "int", online=False, tunable=False)
    variant: str = param("missed", ("full", "missed", "VAR1", "VAR2", "VAR3"), "",
        "full: the paper; missed: groups move missed people alone (ours); VAR1: nobody; VAR2: and are uniform; VAR3: "
        "and p(Z | X) is 1", "categorical", tunable=False)
    individuals: str = param("filtered", ("filtered", "measured"), "",
        "measured: the individuals are the detections, known exactly (DEEPER-JIGT.2)", "categorical", tunable=False)
    algorithm: str = param("ours", ("ours", "paper"), "",
        "paper: a particle has one weight, the proposal is about the detection; ours: neither", "categorical")
    place_noise: float = param(0.25, (0.01, 2.0), "m/s^0.5",
        "jitter of the places in Sigma; the paper gives no Sigma", "log")
    velocity_noise: float = param(0.5, (0.05, 5.0), "m/s^1.5", "change of the velocities in Sigma", "log")
    point_noise: float = param(0.08, (0.005, 2.0), "m", "standard deviation of a measured position, per axis", "log")
    pixel_noise: float = param(0.15, (0.005, 2.0), "m",
        "from pixels: standard deviation of the centre of a blob, per axis (ours)", "log", sees="pixels")
    belief_rate: float = param(20.0, (0.0, 100.0), "1/s",
        "log p(Z | X) is this times the beliefs of the pairs in one group, per second; 0: by the validity (ours)")
    belief_memory: float = param(0.2, (0.0, 2.0), "share",
        "of the belief's `stay` for people reported in one group, and of its `come` for others (ours)")
    detect_prob: float = param(0.9, (0.1, 0.999), "probability",
        "a person who can be detected is detected in a frame (ours)")
    hidden_time: float = param(0.5, (0.05, 10.0), "s",
        "mean time in which a person cannot be detected (ours)", "log")
    # fmt: on
    merge_weights: tuple[float, ...] = _weights("merge")
    split_weights: tuple[float, ...] = _weights("split")

    @property
    def own_weights(self) -> bool:
        """True (algorithm "ours") if people have weights of their own and are resampled one by one."""
        return self.algorithm == "ours"

    @property
    def classifier(self) -> Array:
        """The weights (2, 7) of Merge and Split: of the six features, then the constant."""
        return np.array([self.merge_weights, self.split_weights])

    def rules(self, dt: float) -> Array:
        """Returns the rules (5,) of events in a step of dt s, as group_proposal_kernels has them."""
        every = self.algorithm == "paper"
        return np.array([dt / EVENT_TIME, SHARPNESS, every, SIZE_MEAN, SIZE_STD])


SCALES = np.array([SCATTER, APART])  # The scales (2,) of the validity, as partition_labels_kernels has them.
