"""What falls on the scene through time: where the sun stands, and how bright it is at any moment.

Brightness is a pure function of time and place: exp(drift + flicker + cloud) times the switches that have happened.
Drift has the correlation exp(-|lag| / drift_time), clouds pass over the ground (sim.render.random_fields).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from scenarios.schema.values import draw
from sim.render.random_fields import Waves, passing, relaxing
from sim.rng import rng
from sim.types import Array

if TYPE_CHECKING:
    from scenarios.schema.picture import Light

SUN, DRIFT, FLICKER, SWITCH, CLOUD = range(5)  # keys of the role "light"


@dataclass(frozen=True)
class Illumination:
    """The light of one sequence. sun (3,): unit vector to it; shadow: its share of the light on level ground.

    penumbra m. drift, clouds: logarithms of brightness, everywhere and by place. switches: start, end (s), gain.
    """

    sun: Array
    shadow: float
    penumbra: float
    drift: Waves
    clouds: Waves
    flicker: float
    switches: tuple[tuple[float, float, float], ...]
    seed: int
    repeat: int

    def gain(self, t: float, key: int) -> float:
        """Brightness without clouds at time t (s), about 1 before any switch; key numbers the frame for its flicker."""
        log = self.drift.at(t)
        if self.flicker > 0:
            log += self.flicker * float(rng(self.seed, "light", FLICKER, key, repeat=self.repeat).normal())
        for start, end, gain in self.switches:
            passed = min(max((t - start) / (end - start), 0.0), 1.0) if end > start else float(t >= start)
            log += passed * float(np.log(gain))
        return float(np.exp(log))


def illuminate(light: Light, seed: int, repeat: int = 0) -> Illumination:
    """The light that this seed draws. InputError where the sun is not above the ground, or a switch has no gain."""
    source = rng(seed, "light", SUN, repeat=repeat)
    azimuth, elevation = (np.deg2rad(draw(v, source)) for v in (light.sun_azimuth_deg, light.sun_elevation_deg))
    if not 0 < elevation <= np.pi / 2 + 1e-9:
        raise _refused("light.sun_elevation_deg", float(np.rad2deg(elevation)), "above 0, up to 90")
    sun = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    drift = relaxing(rng(seed, "light", DRIFT, repeat=repeat), light.drift, light.drift_time)
    sky = rng(seed, "light", CLOUD, repeat=repeat)
    cloud = draw(light.cloud, sky)
    if cloud < 0:
        raise _refused("light.cloud", cloud, "0 or more")
    clouds = passing(sky, cloud, light.cloud_size, light.cloud_speed)
    switches = []
    for k, switch in enumerate(light.switch):
        when = rng(seed, "light", SWITCH, k, repeat=repeat)
        at, gain = draw(switch.at, when), draw(switch.gain, when)
        if gain <= 0:
            raise _refused(f"light.switch[{k}].gain", gain, "above 0")
        switches.append((at, at + switch.ramp, gain))
    return Illumination(sun, light.shadow, light.penumbra, drift, clouds, light.flicker, tuple(switches), seed, repeat)


def _refused(place: str, got: float, expected: str) -> InputError:
    return InputError(place=place, got=f"{got:g}", expected=expected, remedy="correct it, or clip its distribution")
