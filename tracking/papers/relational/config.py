"""The parameters of `relational` and `particle`. Lengths are metres; in the image positions are divided by px per m.

`particle` has the parameters of people, `relational` these and those of relations: in a comparison both filters have
the same parameters (sec. 3.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from scenarios.errors import InputError
from sim.types import Array
from tracking.config import param
from tracking.detect.background_settings import BackgroundSettings


@dataclass(frozen=True)
class ParticleConfig(BackgroundSettings):
    """The parameters of the tracker `particle`, a particle filter without relations, and of the background model.

    A speed belongs to the first row of the speed table (Table 3) whose upper end it does not exceed. Raises InputError
    if a value is not allowed, or if clutter_density is 0 and detect_prob is below 1.
    """

    tracker: ClassVar[str] = "particle"

    # fmt: off
    particles: int = param(1000, (50, 20000), "particles", "number of particles", "int", online=False, tunable=False)
    noise_scale: float = param(3.0, (0.1, 10.0), "",
        "the standard deviations of the speed table are multiplied by this (ours)", "log")
    speed_ends: tuple[float, ...] = param((0.15, 0.6, 1.0, 1.4), (0.0, 100.0), "m/s",
        "speed table: upper ends of rows 1 to 4 (column A)", "vector")
    drift: tuple[float, ...] = param((0.0, 0.165, 0.086, 0.047, 0.03), (0.0, 1000.0), "m/s^2",
        "mean deceleration by row (column B)", "vector")
    diffusion: tuple[float, ...] = param((0.074, 0.238, 0.196, 0.123, 0.094), (0.0, 1000.0), "m/s^1.5",
        "standard deviation of the velocity per root second, by row (column C)", "vector")
    point_noise: float = param(0.08, (0.005, 2.0), "m",
        "from points: standard deviation of a measured position, per axis (sec. 3.3)", "log", sees="points")
    pixel_noise: float = param(0.15, (0.005, 2.0), "m",
        "from pixels: standard deviation of the centre of a blob, per axis (ours)", "log", sees="pixels")
    outlier_share: float = param(0.05, (0.0, 0.5), "share",
        "measured positions that are displaced, as by partial occlusion; without effect with the paper's sensor (ours)")
    outlier_noise: float = param(0.4, (0.05, 3.0), "m",
        "standard deviation of a displaced position, per axis, at least that of a position (ours)", "log")
    detect_prob: float = param(0.95, (0.3, 1.0), "probability",
        "that a person who was measured in the last frame is measured (ours)")
    hidden_time: float = param(0.3, (0.05, 20.0), "s",
        "mean time until a missed person is measured again; how long a missed person is reported follows (ours)", "log")
    clutter_density: float = param(0.002, (0.0, 1.0), "1/m^2",
        "false alarms per frame and square metre; 0: none (ours)")
    birth_rate: float = param(0.003, (1e-5, 1.0), "1/(m^2 s)", "new people per square metre and second (ours)", "log")
    time_window: float = param(3.0, (0.1, 30.0), "s",
        "a person who is not measured for so long is removed (sec. 2.1.1)", "log")
    report_existence: float = param(0.5, (0.0, 1.0), "probability",
        "people who exist and have not left with at least this probability are reported (ours)")

    def check(self) -> None:
        """Raises InputError if clutter_density is 0 and detect_prob is below 1."""
        super().check()
        if self.clutter_density == 0 and self.detect_prob < 1:
            raise InputError(
                place="clutter_density", got="0", expected="above 0 if detect_prob is below 1",
                remedy="set both for the paper's sensor: detect_prob 1 and clutter_density 0",
            )  # fmt: skip

    @property
    def certain_sensor(self) -> bool:
        """True for the paper's sensor, without missed people and false alarms: its mappings are complete, and a
        particle has one weight for all people."""
        return self.detect_prob == 1 and self.clutter_density == 0

    def speed_table(self, dt: float) -> Array:
        """Returns the speed table (5, 3) of a step of dt s, as transition_kernels has it."""
        ends, drift, diffusion = ([*self.speed_ends, np.inf], np.array(self.drift), np.array(self.diffusion))
        return np.stack([ends, drift * dt, self.noise_scale * diffusion * np.sqrt(dt)], axis=1)


@dataclass(frozen=True)
class RelationalConfig(ParticleConfig):
    """The parameters of the tracker `relational`: those of `particle` and those of the relation "walking together".

    The state of two people says that they walk together with the probability 1 / (1 + exp(-l)), l = relation_bias -
    relation_distance d - relation_velocity |v1 - v2|.
    """

    tracker: ClassVar[str] = "relational"

    # fmt: off
    coupling_time: float = param(0.15, (0.0, 10.0), "s",
        "time in which people who walk together approach their mean velocity (ours); 0: they have it (sec. 3.2)")
    common_noise: float = param(0.8, (0.0, 1.0), "share",
        "of the velocity noise's variance, common to people who walk together (ours); 0: none (sec. 3.2)")
    relation_evidence: str = param("belief", ("belief", "state"), "",
        "who walks together in the long run, by the belief or the particle's state (ours)", "categorical", online=False)
    relation_rate: float = param(1.6, (0.01, 20.0), "1/s",
        "rate at which the relation of a pair approaches its equilibrium (ours)", "log")
    relation_bias: float = param(5.9, (-40.0, 40.0), "", "log odds of walking together at the same place (ours)")
    relation_distance: float = param(3.3, (0.0, 40.0), "1/m", "loss of log odds per metre of distance (ours)")
    relation_velocity: float = param(5.9, (0.0, 40.0), "s/m", "loss of log odds per m/s of velocity difference (ours)")
    # fmt: on
