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

FITTED: dict[str, float] = tomllib.loads(Path(__file__).with_name("event_classifier.toml").read_text(encoding="utf-8"))[
    "params"
]
TERMS = (
    "distance_early", "velocity_early", "spread_early", "distance_late", "velocity_late", "spread_late", "bias",
)  # fmt: skip
"""Terms of the event classifier, in the order of the features of group_events_kernels."""


def _weight(event: str, term: str, unit: str, meaning: str) -> Any:
    return param(FITTED[f"{event}_{term}"], (-100.0, 100.0), unit, f"{event}: {meaning}", tunable=False)


@dataclass(frozen=True)
class JointConfig(BackgroundSettings):
    """The parameters of the tracker `joint`; each field states default, range and unit.

    They are the numbers of particles, the variant of the paper, the individuals' proposal and dynamics, the cluster
    validity, the events, births and losses, the estimate and the background model. Raises InputError if foreground_time
    is shorter than background_time.
    """

    tracker: ClassVar[str] = "joint"

    particles: int = param(
        50, (1, 2000), "particles", "N_x, particles of individuals", "int", online=False, tunable=False
    )
    partitions: int = param(
        50, (1, 500), "particles", "N_z, partitions under each particle", "int", online=False, tunable=False
    )
    variant: str = param(
        "full",
        ("full", "VAR1", "VAR1-standstill", "VAR2", "VAR3"),
        "",
        "full: the whole model; VAR1: groups do not move individuals; VAR1-standstill: the same, read literally; VAR2: "
        "VAR1, and partitions are drawn uniformly; VAR3: VAR2, and partitions have no validity",
        "categorical",
        tunable=False,
    )
    individuals: str = param(
        "filtered",
        ("filtered", "measured"),
        "",
        "measured: the individuals are the detections, known exactly (DEEPER-JIGT.2)",
        "categorical",
        tunable=False,
    )
    weights: str = param(
        "people",
        ("people", "joint"),
        "",
        "people: each person is resampled by the own part of the weight, then the particles by the rest (ours); joint: "
        "a particle has one weight (the paper)",
        "categorical",
    )

    proposal: str = param(
        "informed",
        ("informed", "detection"),
        "",
        "second part of the proposal; informed: p(x' | x, y) (ours); detection: normal about the detection",
        "categorical",
    )
    alpha: float = param(0.1, (0.0, 1.0), "share", "of the dynamics in the individuals' proposal")
    place_noise: float = param(
        0.25, (0.01, 2.0), "m/s^0.5", "jitter of the places in Sigma; the paper gives no Sigma", "log"
    )
    velocity_noise: float = param(0.5, (0.05, 5.0), "m/s^1.5", "change of the velocities in Sigma", "log")
    group_share: float = param(
        0.25,
        (0.0, 1.0),
        "share",
        "of the group's mean velocity in a member's motion, the rest is the own velocity; 1: eq. 5 (below 1: ours)",
    )
    point_noise: float = param(0.08, (0.005, 2.0), "m", "standard deviation of a measured position, per axis", "log")
    pixel_noise: float = param(
        0.15,
        (0.005, 2.0),
        "m",
        "from pixels: standard deviation of the centre of a blob, per axis (ours)",
        "log",
        sees="pixels",
    )
    most_foreground: float = param(
        0.6,
        (0.05, 1.0),
        "share",
        "from pixels: a frame with a larger share of foreground is ignored (ours)",
        sees="pixels",
    )

    validity_rate: float = param(
        20.0, (0.0, 500.0), "1/s", "lambda_cl: weight of the cluster validity in p(Z | X), per second (ours)"
    )
    belief_rate: float = param(
        20.0,
        (0.0, 100.0),
        "1/s",
        "weight of the beliefs of pairs in log p(Z | X), per second (ours)",
    )
    belief_memory: float = param(
        0.2,
        (0.0, 2.0),
        "share",
        "of the belief's `stay`, which is added for people who were reported in one group, and of `come`, which is "
        "taken from the others (ours)",
    )
    scatter: float = param(
        0.5, (0.05, 2.0), "m", "s_0: prior scatter of a cluster, as of one person more (ours)", "log"
    )
    apart: float = param(2.0, (0.5, 10.0), "m", "D_0: distance of a virtual other cluster (ours)", "log")

    lag: float = param(
        0.4, (0.05, 3.0), "s",
        "between the two times of the features of events; the classifier is fitted at 0.4 s, for another lag it must "
        "be fitted anew (ours)",
        online=False,
    )  # fmt: skip
    event_rate: float = param(1.0, (0.05, 20.0), "", "factor of the rate of merges and splits (ours)", "log")
    newcomers: str = param(
        "validity",
        ("validity", "alone"),
        "",
        "validity: a new person joins the nearest group with the probability of the validity (ours); alone: with label "
        "0 (the paper)",
        "categorical",
    )
    size_prior: str = param(
        "merge",
        ("merge", "all"),
        "",
        "events on which the prior over group sizes acts; all: the paper, merge: ours",
        "categorical",
    )
    size_mean: float = param(1.0, (0.0, 20.0), "people", "mu of the prior over group sizes")
    size_std: float = param(5.0, (0.5, 50.0), "people", "sigma of the prior over group sizes", "log")

    estimate: str = param(
        "binder",
        ("binder", "histogram"),
        "",
        "binder: the partition of least expected Binder loss (ours); histogram: Fig. 3",
        "categorical",
    )

    speed_prior: float = param(1.3, (0.1, 5.0), "m/s", "standard deviation of a new person's velocity (ours)", "log")
    gate: float = param(0.999, (0.9, 0.99999), "probability", "that a detection of a person is in the gate (ours)")
    confirm_time: float = param(
        0.3, (0.0, 3.0), "s",
        "since its first measurement after which a new person is tracked, from the next frame on; it is given up after "
        "so long without one (ours)",
    )  # fmt: skip
    coast_time: float = param(
        1.0,
        (0.1, 10.0),
        "s",
        "people are removed who are missed for longer, in a group all together (ours)",
        "log",
    )

    merge_distance_early: float = _weight("merge", "distance_early", "", "weight of log(1 + d_KL), earlier time")
    merge_velocity_early: float = _weight("merge", "velocity_early", "s/m", "weight of d_v, earlier time")
    merge_spread_early: float = _weight("merge", "spread_early", "1/m", "weight of d_intra, earlier time")
    merge_distance_late: float = _weight("merge", "distance_late", "", "weight of log(1 + d_KL), later time")
    merge_velocity_late: float = _weight("merge", "velocity_late", "s/m", "weight of d_v, later time")
    merge_spread_late: float = _weight("merge", "spread_late", "1/m", "weight of d_intra, later time")
    merge_bias: float = _weight("merge", "bias", "", "constant")
    split_distance_early: float = _weight("split", "distance_early", "", "weight of log(1 + d_KL), earlier time")
    split_velocity_early: float = _weight("split", "velocity_early", "s/m", "weight of d_v, earlier time")
    split_spread_early: float = _weight("split", "spread_early", "1/m", "weight of d_intra, earlier time")
    split_distance_late: float = _weight("split", "distance_late", "", "weight of log(1 + d_KL), later time")
    split_velocity_late: float = _weight("split", "velocity_late", "s/m", "weight of d_v, later time")
    split_spread_late: float = _weight("split", "spread_late", "1/m", "weight of d_intra, later time")
    split_bias: float = _weight("split", "bias", "", "constant")

    @property
    def classifier(self) -> Array:
        """The weights (2, 7) of Merge and Split: of the six features, then the constant."""
        return np.array([[getattr(self, f"{event}_{term}") for term in TERMS] for event in ("merge", "split")])

    @property
    def largest_distance(self) -> float:
        """Squared Mahalanobis distance of the gate: the quantile of chi-squared with 2 degrees of freedom."""
        return float(-2 * np.log1p(-self.gate))

    @property
    def scales(self) -> Array:
        """The scales (2,) of the validity, as partition_kernels has them: s_0, D_0."""
        return np.array([self.scatter, self.apart])

    def rules(self, dt: float, lag: float) -> Array:
        """Return the rules (6,) of events in a step of dt s, as group_events_kernels has them.

        lag: s, in which an event happens, a whole number of frames. The validity has the weight lambda_cl lag where the
        parts of a split are drawn.
        """
        every = self.size_prior == "all"
        return np.array([dt / lag, self.validity_rate * lag, self.event_rate, every, self.size_mean, self.size_std])
