"""The `[light]` and `[picture]` tables of a scenario: sun and shadows, changes of brightness; texture, noise, blur and
plants. They change pictures only, never the truth.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scenarios.schema.values import Distribution, Model, NonNegative, Positive, Share, Value


class LightSwitch(Model):
    """A sudden change of brightness, as of a lamp or a cloud.

    - at: start of the change, s, 0 = frame 1. gain: factor of the brightness after it, above 0; those of several
      switches multiply. Either may be a distribution, drawn once per seed.
    - ramp: duration of the change from `at` on, s; the logarithm of the factor changes evenly; 0 = at once.
    """

    at: Value = Field(description="time of the change, s")
    gain: Value = Field(description="factor of the brightness from then on; above 0")
    ramp: NonNegative = Field(0.2, description="duration of the change, s")


class Light(Model):
    """The light on the scene; it changes pictures only. Brightness changes are relative standard deviations; 0 = none.

    - sun_azimuth_deg (from where the light comes; 0 = from +x, 90 = from +y), sun_elevation_deg (above the ground):
      degrees. Both may be distributions.
    - shadow: share of the brightness lost in a cast shadow; 0 = no shadows. penumbra: width of a shadow's soft edge, m.
    - drift, drift_time: size of slow changes, and time after which their correlation is 0.37, s. flicker: size of
      changes from frame to frame.
    - cloud, cloud_size (distance at which the correlation is 0.6, m), cloud_speed (m/s): soft patches that move over
      the ground, all in one direction, which is drawn per seed.
    - switch: sudden changes of brightness, empty for none.
    """

    sun_azimuth_deg: Value = Field(
        Distribution(uniform=(-180, 180)), description="direction from which the light comes; 0 = from +x, 90 = from +y"
    )
    sun_elevation_deg: Value = Field(Distribution(uniform=(35, 60)), description="angle of the sun above the ground")
    shadow: Share = Field(
        0.3, description="share of the brightness that the ground loses in a cast shadow; 0 = no shadows"
    )
    penumbra: NonNegative = Field(0.05, description="width of a shadow's soft edge, m")
    drift: NonNegative = Field(0.0, description="standard deviation of slow changes of brightness, relative")
    drift_time: Positive = Field(20.0, description="time constant of slow changes, s")
    flicker: NonNegative = Field(
        0.0, description="standard deviation of changes of brightness from frame to frame, relative"
    )
    cloud: Value = Field(
        0.0, description="standard deviation of the brightness of soft patches that move over the ground, relative"
    )
    cloud_size: Positive = Field(8.0, description="size of the patches: distance at which their correlation is 0.6, m")
    cloud_speed: NonNegative = Field(1.0, description="speed of the patches, m/s")
    switch: tuple[LightSwitch, ...] = Field((), description="sudden changes of brightness")


class Picture(Model):
    """Texture, noise, blur and artefacts; they change pictures only.

    - texture: contrast of the patterns on ground and walls, 0 to 1.
    - samples: rays along each axis of a pixel whose colours are averaged, in the empty scene, 1 to 4. Patterns are as
      fine as the distance of the rays, so that more rays show finer grain.
    - noise: standard deviation per pixel and channel at grey level 128, grey levels. shot: share of its variance that
      is proportional to the brightness: at level x the variance is noise² (1 - shot + shot x / 128).
    - blur_px: standard deviation of the blur, px. jpeg: quality 0 to 100; 0 = no compression.
    - foliage: share of the image covered by moving plants, on the ground only. sway_px, sway_time: standard deviation
      of their movement, px, and the time after which its correlation is 0.6, s.
    - right_gain, right_roll_deg, right_down_px: what is wrong with the right picture of a pair, though the calibration
      does not say so: a factor of its brightness, and how far its content is turned clockwise about the image's centre,
      degrees, and moved down, px. True disparities are those of the pair without these errors.
    """

    texture: Share = Field(0.5, description="contrast of the patterns on ground and walls")
    samples: Annotated[int, Field(ge=1, le=4)] = Field(
        1, description="rays along each axis of a pixel of the empty scene, averaged; with more, patterns are finer"
    )
    noise: NonNegative = Field(
        3.0,
        description="standard deviation of the noise of each pixel and colour channel at grey level 128, grey levels",
    )
    shot: Share = Field(0.5, description="share of that noise's variance that is proportional to the brightness")
    blur_px: NonNegative = Field(0.6, description="standard deviation of the blur, px")
    jpeg: Annotated[int, Field(ge=0, le=100)] = Field(
        0, description="quality of JPEG compression, which adds artefacts; 0 = no compression"
    )
    foliage: Value = Field(
        0.0, description="share of the image that is covered by plants moving in the wind; on the ground only"
    )
    sway_px: NonNegative = Field(1.5, description="standard deviation of the plants' movement along each axis, px")
    sway_time: Positive = Field(0.4, description="time after which the correlation of that movement is 0.6, s")
    right_gain: Positive = Field(1.0, description="factor of the right picture's brightness, which is not calibrated")
    right_roll_deg: float = Field(
        0.0, description="angle by which the right picture's content is turned clockwise, which is not calibrated"
    )
    right_down_px: float = Field(
        0.0, description="distance by which the right picture's content lies too low, px, which is not calibrated"
    )
