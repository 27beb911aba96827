"""What changes in the picture of an empty scene: brightness, clouds, and plants in the wind.

Brightness is a pure function of time and place: exp(drift + flicker + cloud) times the gains (factors) of the switches
that have happened. Drift is slow and has the correlation exp(-|lag| / drift_time), both in s. Flicker is fresh in each
frame. Clouds move over the ground. Bushes and long grass are flat: a part of the empty scene's image, with the
ground's depth, which hides nobody. Only their image moves. Wind is a field over the ground, so both cameras of a pair
see the same sway; gusts make all sway stronger and weaker over time.

Random fields are pure functions of place and time: a sum of WAVES = 24 plane waves, amplitude Σ sin(k·x + ω t + φ): x
the place in m, t the time in s, k the wave vector in rad/m, ω the angular frequency in rad/s, φ a random phase. It is
stationary, nearly Gaussian, and has the wanted standard deviation. With k drawn from N(0, 1/length²) per axis, its
correlation over all draws is exp(-r² / 2 length²) at distance r; likewise over time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sim.rng import draw, rng
from sim.scene.raycast import pixel_rays, signed_scale, solids_of
from sim.types import Array, Camera, Scene

if TYPE_CHECKING:
    from scenarios.schema.pictures import Light, Picture

WAVES = 24


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """A random field over ground and time: the sum of W plane waves amplitude sin(k·x + omega t + phase)."""

    amplitude: float  # of each wave, in the field's unit; 0 or more
    k: Array  # (W, 2) wave vectors, rad/m
    omega: Array  # (W,) angular frequencies, rad/s
    phase: Array  # (W,) rad

    def at_origin(self, t: float) -> float:
        """Returns the field's value at the world's origin at time t (s)."""
        return float(self.amplitude * np.sin(self.omega * t + self.phase).sum()) if self.amplitude > 0 else 0.0

    def sampled(self, places: Array, spread: Array) -> Callable[[float], Array]:
        """Returns a function that gives the field's values (N,) at places (N, 2) m at a time in s.

        Around each place the field is averaged by a Gaussian of standard deviation spread (N,) m.
        """
        amplitude = self.amplitude * np.exp(-0.5 * (self.k**2).sum(axis=1) * spread[:, None] ** 2)
        at = places @ self.k.T + self.phase
        sine, cosine = amplitude * np.sin(at), amplitude * np.cos(at)
        return lambda t: np.asarray(sine @ np.cos(self.omega * t) + cosine @ np.sin(self.omega * t))


def _with_random_phases(source: np.random.Generator, sd: float, k: Array, omega: Array) -> PlaneWaves:
    return PlaneWaves(sd * float(np.sqrt(2 / len(omega))), k, omega, source.uniform(0, 2 * np.pi, len(omega)))


def uniform_drift(source: np.random.Generator, sd: float, time: float) -> PlaneWaves:
    """Returns a field of standard deviation sd, the same everywhere, with correlation exp(-|lag| / time); time in s."""
    # A Cauchy distribution of frequencies has this correlation.
    omega = np.tan(np.pi * (source.uniform(size=WAVES) - 0.5)) / time
    return _with_random_phases(source, sd, np.zeros((WAVES, 2)), omega)


def moving_pattern(source: np.random.Generator, sd: float, length: float, speed: float) -> PlaneWaves:
    """Returns a pattern of standard deviation sd that moves unchanged over the ground in a random direction.

    length: m; the correlation at distance r is exp(-r² / 2 length²). speed: m/s.
    """
    angle = source.uniform(0, 2 * np.pi)
    k = source.normal(size=(WAVES, 2)) / length
    return _with_random_phases(source, sd, k, -speed * k @ np.array([np.cos(angle), np.sin(angle)]))


def oscillation(source: np.random.Generator, sd: float, length: float, time: float) -> PlaneWaves:
    """Returns a field of standard deviation sd and correlation exp(-r² / 2 length²) exp(-lag² / 2 time²).

    r and length are in m, lag and time in s.
    """
    return _with_random_phases(source, sd, source.normal(size=(WAVES, 2)) / length, source.normal(size=WAVES) / time)


SUN, DRIFT, FLICKER, SWITCH, CLOUD, RAIN = range(6)  # keys of the random role "light"


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
    # seed, repeat : look seed and number of the suite entry's copy (0: none); they name the flicker's random stream
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
    """Returns the light for a scenario's settings and a `look_seed`. repeat: number of the suite entry's copy, or 0."""
    source = rng(seed, "light", SUN, repeat=repeat)
    azimuth, elevation = (np.deg2rad(draw(v, source)) for v in (light.sun_azimuth_deg, light.sun_elevation_deg))
    elevation = np.clip(elevation, np.deg2rad(0.1), np.pi / 2)  # one draw in a thousand may be beyond
    sun = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    drift = uniform_drift(rng(seed, "light", DRIFT, repeat=repeat), light.drift, light.drift_time)
    sky = rng(seed, "light", CLOUD, repeat=repeat)
    clouds = moving_pattern(sky, max(draw(light.cloud, sky), 0.0), light.cloud_size, light.cloud_speed)
    switches = []
    for k, switch in enumerate(light.switch):
        when = rng(seed, "light", SWITCH, k, repeat=repeat)
        at, gain = draw(switch.at, when), max(draw(switch.gain, when), 1e-3)
        switches.append((at, at + switch.ramp, gain))
    return Illumination(sun, light.shadow, light.penumbra, drift, clouds, light.flicker, tuple(switches), seed, repeat)


def brightness(light: Light, seed: int, repeat: int, fps: float, length: int) -> Array:
    """Returns the factor of brightness in each of the frames 1 … length, (length,), without clouds and flicker."""
    steady = replace(draw_illumination(light, seed, repeat), flicker=0.0)
    return np.array([steady.gain(k / fps, 0) for k in range(length)])


RAIN_SLANT = 0.15  # px to the right per px downwards: standard deviation between sequences, five times that of drops
RAIN_SHARES, RAIN_LENGTHS = (0.08, 0.3), (0.02, 0.07)  # of the sky's colour in a streak; of the picture's height


def rain_drops(rain: float, size: tuple[int, int], level: float, look: tuple[int, int], side: int, frame: int) -> Array:
    """Returns the streaks of one picture for `air_kernels.draw_rain`, (N, 5). rain: streaks in 10,000 px.

    size: width and height, px. level: cosine of the camera's tilt, 0 from above, where each drop is a dot. look:
    look seed and repeat. side, frame: as of `camera_view.noise_offsets`.
    """
    seed, repeat = look
    wind = RAIN_SLANT * rng(seed, "light", RAIN, repeat=repeat).normal()
    source = rng(seed, "light", RAIN, side, frame, repeat=repeat)
    many = source.poisson(rain * size[0] * size[1] / 1e4)
    low, high = np.transpose(
        [RAIN_SHARES, np.maximum(level * size[1] * np.array(RAIN_LENGTHS), 1), (0, 0), (-0.1, 1), (-0.1, 1)]
    )
    drops = source.uniform(low, high, (many, 5))
    drops[:, 2] = wind + RAIN_SLANT / 5 * source.normal(size=many)
    return np.asarray(drops)


SAMPLE_STEP = 4  # px between the samples that decide where plants grow
SWAY_LENGTH = 1.5  # m: correlation length of the sway
GUST, LULL = 0.5, 3.0  # standard deviation of the logarithm of the wind's strength, and its time constant in s
PLACE, ACROSS, DOWN, STRENGTH = range(4)  # keys of the random role "wind"


@dataclass(frozen=True, eq=False)
class Foliage:
    """The plants of a sequence, and the wind that moves them."""

    key: int  # key (whole number) of the random pattern `texture_kernels.plant_pattern`
    level: float  # plants grow where the pattern is above it, no unit
    # two random fields over ground and time: movement in px across and px down at a strength of 1
    sway: tuple[PlaneWaves, PlaneWaves]
    gusts: PlaneWaves  # field, the same everywhere: natural logarithm of the wind's strength, plus 0.25

    def strength(self, t: float) -> float:
        """Returns the wind's strength at time t (s), a factor on the sway; its mean square over time is 1."""
        return float(np.exp(self.gusts.at_origin(t) - GUST**2))


def grow_plants(picture: Picture, camera: Camera, scene: Scene, seed: int, repeat: int = 0) -> Foliage | None:
    """Returns the plants of a `look_seed`; None if their share is 0, or no ground in view is near enough for plants."""
    source = rng(seed, "wind", PLACE, repeat=repeat)
    share = min(draw(picture.foliage, source), 1.0)
    if share <= 0:
        return None
    from sim.render.plants_kernels import sample_plants

    key = int(source.integers(1 << 20))
    width, height = camera.image
    pattern, cover = np.empty((2, -(-height // SAMPLE_STEP), -(-width // SAMPLE_STEP)))
    rays, size = pixel_rays(camera), np.array(scene.size, dtype=float)
    scale = picture.samples * signed_scale(camera)  # leaves show farther away
    sample_plants(rays, scale, SAMPLE_STEP, solids_of(scene), size, key, pattern, cover)
    # The level above which plants cover the wanted share of the image.
    order = np.argsort(-pattern, axis=None, kind="stable")
    covered = np.cumsum(cover.ravel()[order])
    if covered[-1] == 0:
        return None
    last = min(int(np.searchsorted(covered, share * cover.size)), int(np.isfinite(pattern).sum()) - 1)
    across, down = (
        oscillation(rng(seed, "wind", k, repeat=repeat), picture.sway_px, SWAY_LENGTH, picture.sway_time)
        for k in (ACROSS, DOWN)
    )
    gusts = uniform_drift(rng(seed, "wind", STRENGTH, repeat=repeat), GUST, LULL)
    return Foliage(key, float(pattern.ravel()[order[last]]), (across, down), gusts)
