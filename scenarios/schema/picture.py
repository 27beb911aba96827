"""The `[light]` and `[picture]` tables of a scenario: sun and shadows, changes of brightness; texture, noise, blur and
plants. They change pictures only, never the truth.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scenarios.schema.values import Distribution, Model, NonNegative, Positive, Share, Value, within

Pixels = Annotated[float, within(0.0, 100.0, " px")]


class LightSwitch(Model):
    """A sudden change of brightness, as of a lamp or a cloud; those of several switches multiply."""

    at: Value = Field(description="time of the change, s")
    gain: Annotated[Value, within(1e-3, 1000.0)] = Field(description="factor of the brightness from then on; above 0")
    ramp: NonNegative = Field(0.2, description="duration of the change, s")


class Light(Model):
    """The light on the scene; it changes pictures only."""

    sun_azimuth_deg: Value = Field(
        Distribution(uniform=(-180, 180)), description="direction from which the light comes; 0 = from +x, 90 = from +y"
    )
    sun_elevation_deg: Value = Field(Distribution(uniform=(35, 60)), description="angle of the sun above the ground")
    shadow: Share = Field(
        0.3, description="share of the brightness that the ground loses in a cast shadow; 0 = no shadows"
    )
    penumbra: Annotated[float, within(0.0, 100.0, " m")] = Field(0.05, description="width of a shadow's soft edge, m")
    drift: NonNegative = Field(0.0, description="standard deviation of slow changes of brightness, relative")
    drift_time: Positive = Field(20.0, description="time constant of slow changes, s")
    flicker: NonNegative = Field(
        0.0, description="standard deviation of changes of brightness from frame to frame, relative"
    )
    cloud: Annotated[Value, within(0.0, 10.0)] = Field(
        0.0, description="standard deviation of the brightness of soft patches that move over the ground, relative"
    )
    cloud_size: Positive = Field(8.0, description="size of the patches: distance at which their correlation is 0.6, m")
    cloud_speed: Annotated[float, within(0.0, 1000.0, " m/s")] = Field(1.0, description="speed of the patches, m/s")
    switch: tuple[LightSwitch, ...] = Field((), description="sudden changes of brightness")


class Picture(Model):
    """Texture, noise, blur and artefacts; they change pictures only.

    The noise at grey level x has the variance noise² (1 - shot + shot x / 128). True disparities are those of a pair
    without the errors right_….
    """

    texture: Share = Field(0.5, description="contrast of the patterns on ground and walls")
    samples: Annotated[int, Field(ge=1, le=4)] = Field(
        1, description="rays along each axis of a pixel of the empty scene, averaged; with more, patterns are finer"
    )
    noise: Annotated[float, within(0.0, 255.0, " grey levels")] = Field(
        3.0,
        description="standard deviation of the noise of each pixel and colour channel at grey level 128, grey levels",
    )
    shot: Share = Field(0.5, description="share of that noise's variance that is proportional to the brightness")
    blur_px: Pixels = Field(0.6, description="standard deviation of the blur, px")
    jpeg: Annotated[int, Field(ge=0, le=100)] = Field(
        0, description="quality of JPEG compression, which adds artefacts; 0 = no compression"
    )
    foliage: Annotated[Value, within(0.0, 1.0)] = Field(
        0.0, description="share of the image that is covered by plants moving in the wind; on the ground only"
    )
    sway_px: Pixels = Field(1.5, description="standard deviation of the plants' movement along each axis, px")
    sway_time: Positive = Field(0.4, description="time after which the correlation of that movement is 0.6, s")
    right_gain: Annotated[float, within(1e-3, 1000.0)] = Field(
        1.0, description="factor of the right picture's brightness, which is not calibrated"
    )
    right_roll_deg: Annotated[float, within(-10.0, 10.0, " degrees")] = Field(
        0.0, description="angle by which the right picture's content is turned clockwise, which is not calibrated"
    )
    right_down_px: Annotated[float, within(-100.0, 100.0, " px")] = Field(
        0.0, description="distance by which the right picture's content lies too low, px, which is not calibrated"
    )
