"""What looks at people who are already there: camera, sensor, light and picture, without a script (`replay`).

schema = 1                  # may be left out, as any of the tables
[camera]                    # keys of each as in a scenario
[sensor]
[light]
[picture]
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from scenarios.schema.scenario import CameraSpec, Light, Picture
from scenarios.schema.sensor import Sensor
from scenarios.schema.values import Model, NonNegative, Positive


class ObservationSpec(Model):
    """A scenario's tables of what looks on."""

    schema_: Literal[1] = Field(1, alias="schema")
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()


class ReplayOrigin(Model):
    """Whose motion a replay shows.

    real: a recording's, on which nothing is tuned. people: the recording's ids of persons 1, 2, … start, duration: the
    part, s; smoothing: what is quicker, s, is taken for jitter of the labels; shift: our places minus the recording's,
    m; motion: SHA-256 of its labelled places, ids and groups.
    """

    kind: str
    name: str
    real: bool
    people: tuple[int, ...]
    start: NonNegative
    duration: Positive
    smoothing: NonNegative
    shift: tuple[float, float]
    motion: str


class ReplaySpec(ObservationSpec):
    """The resolved form of a replay: what its scenario.toml holds."""

    name: str
    replay: ReplayOrigin
