"""What falls on the scene through time: where the sun stands, and how bright it is at any moment.

Brightness is a pure function of time: exp(drift + flicker) times the switches that have happened. Drift is a sum of
WAVES sinusoids whose frequencies are Cauchy with scale 1/drift_time: a stationary process of the wanted sd whose
correlation, over all draws, is exp(-|lag| / drift_time), like the relaxing process of that name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.distribution import draw
from scenarios.errors import InputError
from sim.rng import rng
from sim.types import Array

if TYPE_CHECKING:
    from scenarios.schema import Light

WAVES = 24
SUN, DRIFT, FLICKER, SWITCH = range(4)  # keys of the role "light"


@dataclass(frozen=True)
class Illumination:
    """The light of one sequence. sun (3,): unit vector to it; shadow: its share of the light on level ground.

    penumbra m. Drift: one amplitude, frequencies (rad/s) and phases of WAVES sinusoids. switches: start, end (s), gain.
    """

    sun: Array
    shadow: float
    penumbra: float
    amplitude: float
    omega: Array
    phase: Array
    flicker: float
    switches: tuple[tuple[float, float, float], ...]
    seed: int
    repeat: int

    def gain(self, t: float, key: int) -> float:
        """Brightness at time t (s), 1 on average before any switch; key numbers the frame for its flicker."""
        log = float(self.amplitude * np.sin(self.omega * t + self.phase).sum()) if self.amplitude > 0 else 0.0
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
    waves = rng(seed, "light", DRIFT, repeat=repeat)
    omega = np.tan(np.pi * (waves.uniform(size=WAVES) - 0.5)) / light.drift_time
    phase = waves.uniform(0, 2 * np.pi, WAVES)
    switches = []
    for k, switch in enumerate(light.switch):
        when = rng(seed, "light", SWITCH, k, repeat=repeat)
        at, gain = draw(switch.at, when), draw(switch.gain, when)
        if gain <= 0:
            raise _refused(f"light.switch[{k}].gain", gain, "above 0")
        switches.append((at, at + switch.ramp, gain))
    amplitude = light.drift * float(np.sqrt(2 / WAVES))
    return Illumination(
        sun, light.shadow, light.penumbra, amplitude, omega, phase, light.flicker, tuple(switches), seed, repeat
    )


def _refused(place: str, got: float, expected: str) -> InputError:
    return InputError(place=place, got=f"{got:g}", expected=expected, remedy="correct it, or clip its distribution")
