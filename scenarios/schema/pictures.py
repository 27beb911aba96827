"""The tables [light] and [picture] of scenario files: how the scene looks, what light and air do, what the lens shows.

They change pictures only. docs/reference/scenario-files.md has the descriptions of the fields, which may all be drawn.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from scenarios.schema.values import Distribution, Model, NonNegative, Positive, Share, Value, within

Pixels = Annotated[float, within(0.0, 100.0, " px")]


class LightSwitch(Model):
    """A sudden change of brightness, as of a lamp or a cloud; the factors of several switches are multiplied.

    Attributes:
        at: time of the change, s
        gain: factor of the brightness from then on; above 0
        ramp: duration of the change, s
    """

    at: Value
    gain: Annotated[Value, within(1e-3, 1000.0)]
    ramp: NonNegative = 0.2


class Light(Model):
    """The light on the scene; it changes pictures only.

    Attributes:
        sun_azimuth_deg: direction from which the light comes; 0 = from +x, 90 = from +y
        sun_elevation_deg: angle of the sun above the ground
        shadow: share of the brightness that the ground loses in a cast shadow; 0 = no shadows
        penumbra: width of a shadow's soft edge, m
        drift: standard deviation of slow changes of brightness, relative
        drift_time: time constant of slow changes, s
        flicker: standard deviation of changes of brightness from frame to frame, relative
        cloud: standard deviation of the brightness of soft patches that move over the ground, relative
        cloud_size: size of the patches: distance at which their correlation is 0.6, m
        cloud_speed: speed of the patches, m/s
        switch: sudden changes of brightness
        level: factor of all brightness: exposure, dusk
        warmth: share by which red is stronger, and blue weaker, as in lamp light or at sunset; negative: cool
        lamps: number of street lamps, each of which lights a pool of ground and the people in it
        lamp_share: share of the light, right below a lamp, that is the lamp's; 1 = black night between the pools
        fog: extinction, 1/m: over a distance d contrast falls to exp(-fog d); not seen from above
        wet: share of the ground that is wet: darker, and a mirror of the sky where seen at a slant
        rain: streaks of falling rain in 10,000 px of a picture
    """

    sun_azimuth_deg: Value = Distribution(uniform=(-180, 180))
    sun_elevation_deg: Annotated[Value, within(0.1, 90.0, " degrees")] = Distribution(uniform=(35, 60))
    shadow: Share = 0.3
    penumbra: Annotated[float, within(0.0, 100.0, " m")] = 0.05
    drift: NonNegative = 0.0
    drift_time: Positive = 20.0
    flicker: NonNegative = 0.0
    cloud: Annotated[Value, within(0.0, 10.0)] = 0.0
    cloud_size: Positive = 8.0
    cloud_speed: Annotated[float, within(0.0, 1000.0, " m/s")] = 1.0
    switch: tuple[LightSwitch, ...] = ()
    level: Annotated[float, within(0.01, 100.0)] = 1.0
    warmth: Annotated[float, within(-0.9, 0.9)] = 0.0
    lamps: Annotated[int, Field(ge=0, le=100)] = 0
    lamp_share: Share = 0.8
    fog: Annotated[float, within(0.0, 10.0, " 1/m")] = 0.0
    wet: Share = 0.0
    rain: Annotated[float, within(0.0, 1000.0)] = 0.0


Ground = Literal["any", "paving", "tiles", "asphalt", "concrete", "gravel", "grass", "floor"]


class Picture(Model):
    """Texture, noise, blur and artefacts; they change pictures only.

    The noise at grey level x has the variance noise² (1 - shot + shot x / 128). True disparities are those of a pair
    without the errors right_….

    Attributes:
        ground: what the ground is made of; any = slabs or asphalt
        grass: false: no grass around the world, nor beside the roads that cross a given ground
        walls: what walls look like, windows = a façade; with all but brick, pillars and steps are smoother, too
        backdrop: what stands behind all people, at the end of the ground; not seen from above
        variety: factor of the standard deviation by which the colours of materials differ between sequences, of 12
            grey levels in brightness
        paint: contrast of painted lines and stripes on the ground
        stains: contrast of stains, cracks, manholes and litter on the ground
        texture: contrast of the patterns on ground and walls
        samples: rays along each axis of a pixel of the empty scene, averaged; with more, patterns are finer
        noise: standard deviation of the noise of each pixel and colour channel at grey level 128, grey levels
        shot: share of that noise's variance that is proportional to the brightness
        blur_px: standard deviation of the blur, px
        sharpen: strength of the camera's edge enhancement, which leaves bright and dark seams; 0 = none
        contrast: factor of all differences from grey level 128
        grey: true: a picture without colours
        shutter: time for which the shutter is open, s: people who move are blurred
        jpeg: quality of JPEG compression, which adds artefacts; 0 = no compression
        foliage: share of the image that is covered by plants moving in the wind; on the ground only
        sway_px: standard deviation of the plants' movement along each axis, px
        sway_time: time after which the correlation of that movement is 0.6, s
        right_gain: factor of the right picture's brightness, which is not calibrated
        right_roll_deg: angle by which the right picture's content is turned clockwise, which is not calibrated
        right_down_px: distance by which the right picture's content lies too low, px, which is not calibrated
    """

    ground: Ground = "any"
    grass: bool = True
    walls: Literal["brick", "plaster", "panels", "windows"] = "brick"
    backdrop: Literal["none", "hedge", "woods", "houses"] = "none"
    variety: Annotated[float, within(0.0, 10.0)] = 1.0
    paint: Share = 0.0
    stains: Share = 0.0
    texture: Share = 0.5
    samples: Annotated[int, Field(ge=1, le=4)] = 1
    noise: Annotated[float, within(0.0, 255.0, " grey levels")] = 3.0
    shot: Share = 0.5
    blur_px: Pixels = 0.6
    sharpen: Annotated[float, within(0.0, 3.0)] = 0.0
    contrast: Annotated[float, within(0.01, 10.0)] = 1.0
    grey: bool = False
    shutter: Annotated[float, within(0.0, 1.0, " s")] = 0.0
    jpeg: Annotated[int, Field(ge=0, le=100)] = 0
    foliage: Annotated[Value, within(0.0, 1.0)] = 0.0
    sway_px: Pixels = 1.5
    sway_time: Positive = 0.4
    right_gain: Annotated[float, within(1e-3, 1000.0)] = 1.0
    right_roll_deg: Annotated[float, within(-10.0, 10.0, " degrees")] = 0.0
    right_down_px: Annotated[float, within(-100.0, 100.0, " px")] = 0.0
