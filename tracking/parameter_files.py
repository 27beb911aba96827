"""Files of parameters: TOML with an optional `tracker = "name"` and a table [params], and the folders of named ones.

tracking/presets/NAME/TRACKER.toml is the preset NAME of a tracker. This module reads and writes values as they stand;
tracking.config checks them.
"""

from __future__ import annotations

import os.path
from collections.abc import Mapping
from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading.toml_files import parse, toml_value

PRESETS = Path(__file__).parent / "presets"
"""Folder with a folder for each preset, which holds TRACKER.toml."""


def read(path: str | Path, tracker: str) -> dict[str, object]:
    """Return the table [params] of a TOML file, unchecked; {} if there is none.

    tracker: the name that the file may give as its tracker. Raises InputError if the file cannot be read, is no TOML,
    is of another tracker, or has other keys than tracker and [params].
    """
    content = parse(Path(path))
    name = content.pop("tracker", tracker)
    if name != tracker:
        remedy = "give the file to the tracker it was made for"
        raise InputError(file=path, place="tracker", got=repr(name), expected=tracker, remedy=remedy)
    values = content.pop("params", {})
    if content or not isinstance(values, dict):
        got, remedy = ", ".join(content) or "params", "put the parameters under [params]"
        raise InputError(file=path, got=got, expected="tracker and [params]", remedy=remedy)
    return values


def toml_text(tracker: str, values: Mapping[str, object]) -> str:
    """Return the text of a TOML file that `read` reads: the tracker's name and all values, in their order."""
    lines = [f"{name} = {toml_value(value)}" for name, value in values.items()]
    return "\n".join([f"tracker = {toml_value(tracker)}", "", "[params]", *lines, ""])


def presets(tracker: str) -> tuple[str, ...]:
    """Return the names of the presets of a tracker, sorted; () if it has none."""
    return tuple(sorted(found.parent.name for found in PRESETS.glob("*/*.toml") if found.stem == tracker))


def preset_file(tracker: str, name: str) -> Path:
    """Return the file of the preset `name` of a tracker. Raises InputError, with the known names, if there is none."""
    known = presets(tracker)
    if name not in known:
        expected = "one of " + ", ".join(known) if known else f"nothing: {tracker} has no presets"
        raise InputError(place="preset", got=name, expected=expected, remedy="check the name")
    return PRESETS / name / f"{tracker}.toml"


def file_of(tracker: str, source: str | Path) -> Path:
    """Return the file of the tracker's preset that is named `source`, else the path `source` itself.

    A Path names no preset. Raises InputError, with the names of the presets, if the tracker has presets and `source` is
    neither one of them nor a file. Without presets the path is not checked.
    """
    known = presets(tracker)
    if isinstance(source, str) and source in known:
        return preset_file(tracker, source)
    if known and not os.path.exists(source):
        expected = f"a parameter file, or a preset of {tracker}: {', '.join(known)}"
        raise InputError(file=source, got="No such file or directory", expected=expected, remedy="check the path")
    return Path(source)
