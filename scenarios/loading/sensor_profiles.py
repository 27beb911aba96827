"""Files that hold a `[sensor]` table alone: a detector's profile, as `flockscope fit sensor` writes it.

`sensor_settings(path)` gives it as `--set` takes it, so that whatever takes settings of a scenario takes a detector:
`scenarios.load("street", set=scenarios.sensor_settings("mine.toml"))`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from scenarios.errors import InputError
from scenarios.loading.toml_files import Table, parse, toml_value
from scenarios.loading.validation import validate
from scenarios.schema.sensor import Sensor
from scenarios.schema.values import Model


class SensorFile(Model):
    """The whole file."""

    schema_: Literal[1] = Field(1, alias="schema")
    sensor: Sensor


def sensor_settings(path: str | Path) -> tuple[str, ...]:
    """`sensor.key=value` for every key of the file; InputError where it is no sensor's table."""
    return tuple(f"sensor.{key}={toml_value(v)}" for key, v in sensor_table(path).items())


def sensor_table(path: str | Path) -> Table:
    """The keys of the file's `[sensor]` that are given, checked."""
    path = Path(path)
    if not path.is_file():
        raise InputError(
            file=path, got="no such file", expected="a file with a [sensor] table",
            remedy="check the path, or write one with `flockscope fit sensor`",
        )  # fmt: skip
    table = parse(path)
    validate(table, path, model=SensorFile)
    given: Table = table["sensor"]
    return given


def dump_sensor(sensor: Sensor, about: str = "") -> str:
    """The file of a sensor, every key that is there spelt out; about: comment lines above it."""
    table = sensor.model_dump(mode="python", exclude_none=True)
    lines = [f"# {line}".rstrip() for line in about.splitlines()]
    rows = [f"{key} = {toml_value(v)}" for key, v in table.items() if key != "hide" or v]
    return "\n".join([*lines, "schema = 1", "", "[sensor]", *rows, ""])
