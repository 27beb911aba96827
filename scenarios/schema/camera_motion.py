"""The key `camera.motion` of scenario files: how a pinhole camera moves while it records."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.schema.schedule import Movements
from scenarios.schema.values import FixedPoint, Model, Positive, problem, within

Degrees = Annotated[float, within(0.0, 90.0, " degrees")]
Rate = Annotated[float, within(-90.0, 90.0, " degrees/s")]
Hertz = Annotated[float, within(0.01, 50.0, " Hz")]


class ShakeSpec(Model):
    """A camera that trembles about its place, held in a hand or on a mast in the wind.

    Attributes:
        kind: the camera trembles
        px: standard deviation of the movement of the picture's middle along each axis, px
        roll_deg: standard deviation of the turn about the optical axis, degrees; if px changes, where it is largest
        band: lowest and highest frequency of the movement, Hz
    """

    kind: Literal["shake"]
    px: Movements = 8.0
    roll_deg: Degrees = 0.2
    band: tuple[Hertz, Hertz] = (0.5, 5.0)

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.band[0] > self.band[1]:
            raise problem(str(list(self.band)), "[lowest, highest]", "exchange them")
        return self


class PanSpec(Model):
    """A camera that turns about the vertical.

    Attributes:
        kind: the camera turns
        deg_per_s: speed of the turn, degrees/s; positive turns left
        sweep_deg: the camera turns back whenever it has turned by this angle, degrees; absent: it turns on and on
    """

    kind: Literal["pan"]
    deg_per_s: Rate = 3.5
    sweep_deg: Annotated[float, within(0.1, 360.0, " degrees")] | None = None


class DriftSpec(Model):
    """A camera whose mount yields: its optical axis moves slowly in a direction that is drawn.

    Attributes:
        kind: the camera drifts
        deg_per_s: speed of the optical axis, degrees/s
    """

    kind: Literal["drift"]
    deg_per_s: Annotated[float, within(0.0, 90.0, " degrees/s")] = 0.5


class RobotSpec(Model):
    """A camera that is carried along a path through the scene and looks ahead; people do not avoid it.

    It stands at the first point until frame 1, and at the last one from its arrival on. `camera.yaw_deg` counts from
    the direction of the path; `camera.height` and `camera.position` are those of the motion.

    Attributes:
        kind: the camera walks
        path: points x, y of its way, m
        speed: speed along the way, m/s
        height: height above the ground, m
        bob: amplitude of the vertical movement with each step of 0.7 m, m; 0 = on wheels
    """

    kind: Literal["robot"]
    path: Annotated[tuple[FixedPoint, ...], Field(min_length=2)]
    speed: Annotated[float, within(0.01, 20.0, " m/s")] = 0.8
    height: Positive = 1.3
    bob: Annotated[float, within(0.0, 0.2, " m")] = 0.02

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Self:
        if any(a == b for a, b in zip(self.path, self.path[1:], strict=False)):
            raise problem("a point twice in a row", "points that differ", "leave one of them out")
        return self


CameraMotion = Annotated[ShakeSpec | PanSpec | DriftSpec | RobotSpec, Field(discriminator="kind")]
