"""The tables of a scenario that describe observation only: camera, sensor, light and picture, without a script.

`flockscope replay` reads a file of these tables, all of which may be absent:

    schema = 1
    [camera]
    [sensor]
    [light]
    [picture]
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from scenarios.schema.picture import Light, Picture
from scenarios.schema.scenario import CameraSpec
from scenarios.schema.sensor import Sensor
from scenarios.schema.values import Model, NonNegative, Positive


class ObservationSpec(Model):
    """Camera, sensor, light and picture, with the keys that they have in a scenario."""

    schema_: Literal[1] = Field(1, alias="schema")
    camera: CameraSpec = CameraSpec()
    sensor: Sensor = Sensor()
    light: Light = Light()
    picture: Picture = Picture()


class ReplayOrigin(Model):
    """The recording whose motion a replay shows.

    - kind, name: format ("biwi", "mot", …) and name of the recording. real: it shows real people, so nothing may be
      tuned on it.
    - people: the recording's ids of persons 1, 2, … of the replay, in this order.
    - start, duration: the part that is replayed, s. shift: positions in the replay minus those in the recording, x, y,
      m.
    - smoothing: movements of the labels that are quicker than this are removed as jitter, s; 0: none.
    - motion: SHA-256 of the recording's labelled positions, ids and groups.
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
    """A replay with all defaults filled in, as stored in its scenario.toml."""

    name: str
    replay: ReplayOrigin
