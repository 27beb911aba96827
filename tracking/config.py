"""How a tracker declares its parameters: a frozen dataclass, from which search space, files and docs table are derived.

A field is declared as `gate: float = param(0.99, (0.9, 0.9999), "probability", "share of ...")`. Parameters are
seconds, metres and rates, never frame counts. The search space of `tune`, the action space of the environment and the
table in the docs are read from the declarations. Files are TOML: an optional `tracker = "name"` and a table [params];
tracking/presets/NAME/TRACKER.toml is the preset NAME of a tracker.
"""

from __future__ import annotations

import dataclasses
import os.path
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, cast

from scenarios.errors import InputError
from scenarios.limits import is_number
from scenarios.loading.toml_files import did_you_mean, parse, toml_value
from tracking.user_code import tracker_failed, user_code

Scale = Literal["linear", "log", "int", "categorical", "vector"]
Value = float | int | str | bool | tuple[float, ...]

PRESETS = Path(__file__).parent / "presets"  # Folder with a folder for each preset, which holds TRACKER.toml.


@dataclass(frozen=True)
class Param:
    """One declared parameter of a tracker, as `param` describes it."""

    name: str
    default: Value
    unit: str
    meaning: str
    scale: Scale  # "vector": as many numbers as the default has
    low: float = float("-inf")  # both ends are allowed
    high: float = float("inf")
    choices: tuple[Value, ...] = ()  # of a categorical parameter
    online: bool = True  # it may change between two frames
    tunable: bool = True  # searches may change it
    sees: str = ""  # "pixels" or "points" if it has an effect only with these

    @property
    def expected(self) -> str:
        """The allowed values in words, for error messages."""
        if self.scale == "categorical":
            return "one of " + ", ".join(str(c) for c in self.choices)
        kind = "an integer" if self.scale == "int" else "a number"
        kind = f"{len(self.default)} numbers" if isinstance(self.default, tuple) else kind
        return f"{kind} from {self.low:g} to {self.high:g}"

    def check(self, value: object, file: object = "") -> Value:
        """Returns the value converted to the parameter's type (for scale "int" 3.0 becomes 3). Raises InputError, about
        `file`, if the value is not allowed."""
        if self.scale == "categorical":
            if any(type(value) is type(c) and value == c for c in self.choices):
                return value  # type: ignore[return-value]
        elif isinstance(self.default, tuple):
            good = isinstance(value, tuple | list) and len(value) == len(self.default)
            if good and all(is_number(v, self.low, self.high) for v in cast("tuple[float]", value)):
                return tuple(map(float, cast("tuple[float]", value)))
        elif is_number(value, self.low, self.high):
            if self.scale != "int":
                return float(value)
            if value == int(value):
                return int(value)
        remedy = f"the default is {self.default}"
        raise InputError(file=file, place=self.name, got=repr(value), expected=self.expected, remedy=remedy)

    def parse(self, text: str) -> Value:
        """Returns the value that a text stands for; commas separate numbers of a vector. Raises InputError if wrong."""
        from sim.store.numeric_text import read_number

        for choice in self.choices:
            if text == str(choice) or (isinstance(choice, bool) and text.lower() == str(choice).lower()):
                return choice
        try:
            if self.scale == "vector":
                return self.check([read_number(part) for part in text.strip("[] ").split(",")])
            return self.check(read_number(text))
        except ValueError:
            return self.check(text)


def param(
    default: Value, values: tuple[Any, ...], unit: str, meaning: str, scale: Scale = "linear", *,
    online: bool = True, tunable: bool = True, sees: Literal["", "pixels", "points"] = "",
) -> Any:  # fmt: skip
    """Declares a parameter as a field of a config.

    Args:
        default: The default value. It is checked only when a config is created.
        values: (low, high), both ends allowed, or all choices if scale is "categorical".
        unit: The unit, shown in the docs.
        meaning: A description for the docs; the word "ours" marks a departure from the paper.
        scale: How a search moves: "linear" or "log" for numbers, "int" for whole numbers, "categorical" for choices;
            "vector" for a tuple of numbers, which no search moves.
        online: Whether it may change between two frames.
        tunable: Whether searches may change it.
        sees: The only input with which the parameter has an effect, "pixels" or "points"; "": any. Searches with
            another input leave the parameter out.

    Raises:
        ValueError: `values` are not two, though the scale is not "categorical".
    """
    categorical = scale == "categorical"
    low, high = (float("-inf"), float("inf")) if categorical else values
    choices, tunable = values if categorical else (), tunable and scale != "vector"
    declared = Param("", default, unit, meaning, scale, low, high, choices, online, tunable, sees)
    return dataclasses.field(default=default, metadata={"param": declared})


@dataclass(frozen=True)
class Config:
    """Base class of configs: a subclass is a frozen dataclass that sets `tracker` and declares its fields with `param`.

    Numbers are converted to float, or to int if the scale is "int".

    Attributes:
        tracker: Name of the tracker, for files and messages.

    Raises:
        InputError: A value is not allowed, or `check` refuses the values together.
        WorkError: `check` raises anything but a FlockscopeError.
    """

    tracker: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, declared in self.params().items():
            object.__setattr__(self, name, declared.check(getattr(self, name)))
        with user_code(lambda error: tracker_failed(type(self).tracker, "check()", "its parameters", error)):
            self.check()

    def check(self) -> None:
        """Raises InputError if the parameters contradict each other; for subclasses."""

    @classmethod
    def params(cls) -> dict[str, Param]:
        """Returns all parameters that are declared with `param` by name, inherited ones first."""
        return dict(_declared(cls))  # type: ignore[arg-type]  # classes can be hashed

    @classmethod
    def space(cls, *, online: bool = False) -> tuple[Param, ...]:
        """Returns the tunable parameters; if `online` is True, only those that may change between two frames."""
        return tuple(p for p in cls.params().values() if p.tunable and (p.online or not online))

    @classmethod
    def known(cls, name: str, file: object = "") -> Param:
        """Returns the declared parameter of this name. Raises InputError, about `file`, for an unknown name; it
        suggests the most similar one."""
        declared = cls.params()
        if name in declared:
            return declared[name]
        remedy = did_you_mean(name, declared) if declared else "it has no parameters"
        raise InputError(file=file, place=name, got=repr(name), expected=f"a parameter of {cls.tracker}", remedy=remedy)

    @classmethod
    def from_dict(cls, values: Mapping[str, object], file: object = "") -> Self:
        """Returns the config with these values by parameter name, and defaults for the others.

        Raises:
            InputError: A name is unknown, a value is not allowed (the message names `file`), or values contradict each
                other.
        """
        return cls(**{name: cls.known(name, file).check(value, file) for name, value in values.items()})

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Returns the config in a TOML file; parameters that it lacks have their defaults.

        Raises:
            InputError: The file cannot be read, is of another tracker or has unknown keys, or values are not allowed.
        """
        return cls.from_dict(read_params(path, cls.tracker), path)

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """Returns the preset of the name `source` if the tracker has one, else the config in the TOML file `source`.

        The preset "paper" turns off the departures from the tracker's paper that have a parameter. To load a file whose
        name is that of a preset, give it with a folder, such as ./paper."""
        return cls.from_toml(file_of(cls.tracker, source))

    def with_set(self, *assignments: str) -> Self:
        """Returns a copy with assignments "name=value" or "tracker.name=value" applied.

        Each value is checked in turn, their combination at the end.

        Raises:
            InputError: An assignment has no "=", a name is unknown, or values are wrong or contradict each other.
        """
        changes: dict[str, Any] = {}
        for assignment in assignments:
            name, sign, text = assignment.removeprefix("tracker.").partition("=")
            if not sign:
                remedy = "write --set tracker.NAME=VALUE"
                raise InputError(place="--set", got=repr(assignment), expected="name=value", remedy=remedy)
            changes[name.strip()] = self.known(name.strip(), "--set").parse(text.strip())
        return dataclasses.replace(self, **changes)

    def as_dict(self) -> dict[str, Value]:
        """Returns the values of all parameters by name, in order of the fields."""
        return {name: getattr(self, name) for name in self.params()}

    def to_toml(self) -> str:
        """Returns the text of a TOML file from which `from_toml` reads an equal config."""
        return toml_text(self.tracker, self.as_dict())


@cache
def _declared(kind: type[Config]) -> dict[str, Param]:
    found = [f for f in dataclasses.fields(kind) if "param" in f.metadata]
    return {f.name: dataclasses.replace(f.metadata["param"], name=f.name) for f in found}


def read_params(path: str | Path, tracker: str) -> dict[str, object]:
    """Returns the table [params] of a TOML file, values unchecked; {} if the file has no such table. Raises InputError
    if the file is of another tracker or has other keys."""
    content = parse(Path(path))
    name = content.pop("tracker", tracker)
    require_tracker(name, tracker, path)
    values = content.pop("params", {})
    if content or not isinstance(values, dict):
        got, remedy = ", ".join(content) or "params", "put the parameters under [params]"
        raise InputError(file=path, got=got, expected="tracker and [params]", remedy=remedy)
    return values


def require_tracker(name: object, tracker: str, path: str | Path) -> None:
    """Raises InputError if `name`, in a file of parameters, is not that of the tracker."""
    if name != tracker:
        remedy = "give the file to the tracker it was made for"
        raise InputError(file=path, place="tracker", got=repr(name), expected=tracker, remedy=remedy)


def toml_text(tracker: str, values: Mapping[str, object]) -> str:
    """Returns the text of a TOML file with the tracker's name and all values."""
    lines = [f"{name} = {toml_value(value)}" for name, value in values.items()]
    return "\n".join([f"tracker = {toml_value(tracker)}", "", "[params]", *lines, ""])


def presets(tracker: str) -> tuple[str, ...]:
    """Returns the names of the presets of a tracker, sorted; () if it has none."""
    return tuple(sorted(found.parent.name for found in PRESETS.glob("*/*.toml") if found.stem == tracker))


def file_of(tracker: str, source: str | Path) -> Path:
    """Returns the file of the tracker's preset if `source` is a preset's name (str), else the path `source`. Raises
    InputError if the tracker has presets and `source` is neither a preset nor an existing file."""
    known = presets(tracker)
    if isinstance(source, str) and source in known:
        return PRESETS / source / f"{tracker}.toml"
    if known and not os.path.exists(source):
        expected = f"a parameter file, or a preset of {tracker}: {', '.join(known)}"
        raise InputError(file=source, got="No such file or directory", expected=expected, remedy="check the path")
    return Path(source)
