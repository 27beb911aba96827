"""Reads and writes files with a `[sensor]` table alone: the profile of a detector, made by `flockscope fit sensor`.

`sensor_settings(path)` returns the keys as settings, so every function that takes settings of a scenario takes a
profile: `scenarios.load("street", set=scenarios.sensor_settings("mine.toml"))`.
"""

from __future__ import annotations

import os.path
from pathlib import Path
from typing import Literal

from pydantic import Field

from scenarios.errors import InputError
from scenarios.loading.toml_files import Table, parse, toml_value
from scenarios.loading.validation import validate
from scenarios.schema.sensor import Sensor
from scenarios.schema.values import Model


class SensorFile(Model):
    """The content of a profile file: `schema` (1, may be absent) and the required table `[sensor]`."""

    schema_: Literal[1] = Field(1, alias="schema")
    sensor: Sensor


def sensor_settings(path: str | Path) -> tuple[str, ...]:
    """Returns the profile of a detector as settings of a scenario.

    Args:
        path: A TOML file with a [sensor] table.

    Returns:
        A setting "sensor.key=value" for each key given in the file.

    Raises:
        InputError: The file does not exist.
    """
    return tuple(f"sensor.{key}={toml_value(v)}" for key, v in sensor_table(path).items())


def sensor_table(path: str | Path) -> Table:
    """Returns the keys given in the file's [sensor] table with their values, without defaults."""
    path = Path(path)
    if not os.path.exists(path):
        raise InputError(
            file=path, got="no such file", expected="a file with a [sensor] table",
            remedy="check the path, or make one with `flockscope fit sensor`",
        )  # fmt: skip
    table = parse(path)
    validate(table, path, model=SensorFile)
    given: Table = table["sensor"]
    return given


def dump_sensor(sensor: Sensor, about: str = "") -> str:
    """Returns the text of a profile file with all keys of a sensor; `about` becomes comment lines at the top."""
    table = sensor.model_dump(mode="python", exclude_none=True)
    lines = [f"# {line}".rstrip() for line in about.splitlines()]
    rows = [f"{key} = {toml_value(v)}" for key, v in table.items() if key != "hide" or v]
    return "\n".join([*lines, "schema = 1", "", "[sensor]", *rows, ""])
