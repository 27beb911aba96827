"""What looks at people who are already there: camera, sensor, light and picture, without a script (`replay`).

schema = 1                  # may be left out, as any of the tables
[camera]                    # keys of each as in a scenario
[sensor]
[light]
[picture]
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

from pydantic import Field

from scenarios.errors import InputError
from scenarios.loading.overrides import apply
from scenarios.loading.toml_files import parse
from scenarios.loading.validation import validate
from scenarios.schema.model import Model, NonNegative, Positive
from scenarios.schema.scenario import CameraSpec, Light, Picture
from scenarios.schema.sensor import Sensor


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


def load_observation(path: str | Path | None = None, set: Iterable[str] = ()) -> ObservationSpec:
    """The view of a file (None: all defaults) with every `key=value` of `set` applied; InputError otherwise."""
    if path is not None and not Path(path).is_file():
        raise InputError(
            file=path, got="no such file", expected="a TOML file with [camera]", remedy="check --camera"
        )  # fmt: skip
    file = Path(path) if path is not None else ""
    table, places = apply({} if path is None else parse(Path(path)), tuple(set), file)
    return validate(table, file, places, model=ObservationSpec)
