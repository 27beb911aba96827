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
    """The light of one sequence. Logarithms are natural ones; times count from frame 1.

    sun (3,)       unit vector to the sun, x, y, z
    shadow         the sun's share of the light on level ground, 0 to 1; 0: people cast no shadows
    penumbra       width of a shadow's soft edge, m
    drift          random field: slow changes of the logarithm of brightness, the same everywhere
    clouds         random field: patches of the logarithm of brightness that move over the ground
    flicker        standard deviation of the logarithm of brightness from frame to frame
    switches       sudden changes: (start s, end s, gain) each; gain is the factor of brightness from the end on
    seed, repeat   seed and number of the suite entry's copy (0: none); they name the random stream of the flicker
    """

    sun: Array
    shadow: float
    penumbra: float
    drift: PlaneWaves
    clouds: PlaneWaves
    flicker: float
    switches: tuple[tuple[float, float, float], ...]
    seed: int
    repeat: int

    def gain(self, t: float, key: int) -> float:
        """Return the factor of brightness at time t (s), clouds left out: about 1 before any switch, always above 0.

        It combines drift, flicker and switches. t is 0 at frame 1. key: frame number from 1 plus BACKGROUNDS (50), 0 or
        more; it names the random stream of the flicker. The logarithm of a switch's gain rises linearly from its start
        to its end; a switch without duration acts at once. Raises ValueError for a negative key or seed if there is
        flicker.
        """
        log = self.drift.at_origin(t)
        if self.flicker > 0:
            log += self.flicker * float(rng(self.seed, "light", FLICKER, key, repeat=self.repeat).normal())
        for start, end, gain in self.switches:
            passed = min(max((t - start) / (end - start), 0.0), 1.0) if end > start else float(t >= start)
            log += passed * float(np.log(gain))
        return float(np.exp(log))


def draw_illumination(light: Light, seed: int, repeat: int = 0) -> Illumination:
    """Return the Illumination that a scenario's light settings and this seed give; the same arguments give the same
    light.

    repeat: number of the suite entry's copy, 0 without copies. Raises InputError if a drawn value is impossible: the
    sun's elevation not in (0°, 90°], a negative cloud, or a switch gain that is not above 0. Raises ValueError for a
    negative seed.
    """
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
