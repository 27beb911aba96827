"""The light of a sequence through time: where the sun stands, and how bright the scene is at any moment.

Brightness is a pure function of time and place: exp(drift + flicker + cloud) times the gains (factors) of the switches
that have happened. Drift is slow and has the correlation exp(-|lag| / drift_time), both in s. Flicker is fresh in each
frame. Clouds move over the ground (`sim.render.random_fields`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.render.random_fields import PlaneWaves, moving_pattern, uniform_drift
from sim.rng import draw, rng
from sim.types import Array

if TYPE_CHECKING:
    from scenarios.schema.picture import Light

SUN, DRIFT, FLICKER, SWITCH, CLOUD = range(5)  # keys of the random role "light"


@dataclass(frozen=True)
class Illumination:
    """The light of one sequence. Logarithms are natural ones; times count from frame 1."""

    sun: Array  # (3,) unit vector to the sun, x, y, z
    shadow: float  # the sun's share of the light on level ground, 0 to 1; 0: people cast no shadows
    penumbra: float  # width of a shadow's soft edge, m
    drift: PlaneWaves  # random field: slow changes of the logarithm of brightness, the same everywhere
    clouds: PlaneWaves  # random field: patches of the logarithm of brightness that move over the ground
    flicker: float  # standard deviation of the logarithm of brightness from frame to frame
    # sudden changes: (start s, end s, gain) each; gain is the factor of brightness from the end on
    switches: tuple[tuple[float, float, float], ...]
    # seed, repeat : seed and number of the suite entry's copy (0: none); they name the random stream of the flicker
    seed: int
    repeat: int

    def gain(self, t: float, key: int) -> float:
        """Returns the factor of brightness at time t (s), clouds left out, about 1 before any switch.

        key: frame number from 1 plus BACKGROUNDS; it names the random stream of the flicker.
        """
        log = self.drift.at_origin(t)
        if self.flicker > 0:
            log += self.flicker * float(rng(self.seed, "light", FLICKER, key, repeat=self.repeat).normal())
        for start, end, gain in self.switches:
            passed = min(max((t - start) / (end - start), 0.0), 1.0) if end > start else float(t >= start)
            log += passed * float(np.log(gain))
        return float(np.exp(log))


def draw_illumination(light: Light, seed: int, repeat: int = 0) -> Illumination:
    """Returns the light that a scenario's settings and this seed give."""
    source = rng(seed, "light", SUN, repeat=repeat)
    azimuth, elevation = (np.deg2rad(draw(v, source)) for v in (light.sun_azimuth_deg, light.sun_elevation_deg))
    if not 0 < elevation <= np.pi / 2 + 1e-9:
        raise _impossible("light.sun_elevation_deg", float(np.rad2deg(elevation)), "above 0, at most 90")
    sun = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    drift = uniform_drift(rng(seed, "light", DRIFT, repeat=repeat), light.drift, light.drift_time)
    sky = rng(seed, "light", CLOUD, repeat=repeat)
    cloud = draw(light.cloud, sky)
    if cloud < 0:
        raise _impossible("light.cloud", cloud, "0 or more")
    clouds = moving_pattern(sky, cloud, light.cloud_size, light.cloud_speed)
    switches = []
    for k, switch in enumerate(light.switch):
        when = rng(seed, "light", SWITCH, k, repeat=repeat)
        at, gain = draw(switch.at, when), draw(switch.gain, when)
        if gain <= 0:
            raise _impossible(f"light.switch[{k}].gain", gain, "above 0")
        switches.append((at, at + switch.ramp, gain))
    return Illumination(sun, light.shadow, light.penumbra, drift, clouds, light.flicker, tuple(switches), seed, repeat)


def _impossible(place: str, got: float, expected: str) -> InputError:
    return InputError(place=place, got=f"{got:g}", expected=expected, remedy="correct it, or clip its distribution")
