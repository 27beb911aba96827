"""How a tracker declares its parameters: a frozen dataclass, from which search space, files and docs table are derived.

A field is declared as `gate: float = param(0.99, (0.9, 0.9999), "probability", "share of ...")`. Parameters are
seconds, metres and rates, never frame counts. The search space of `tune`, the action space of the environment and the
table in the docs are read from the declarations. Presets are TOML files:
tracking.parameter_files.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, TypedDict, Unpack, cast

from scenarios.errors import InputError
from scenarios.limits import is_number
from scenarios.loading.toml_files import closest
from sim.io.files.numeric_text import read_number
from tracking.parameter_files import file_of, preset_file, presets, read, toml_text
from tracking.running.user_code import tracker_failed, user_code

Scale = Literal["linear", "log", "int", "categorical", "vector"]
Value = float | int | str | bool | tuple[float, ...]


@dataclass(frozen=True)
class Param:
    """One declared parameter of a tracker.

    name; default; unit and meaning: texts for the docs. scale: "linear", "log", "int", "categorical", or "vector" for
    as many numbers as the default has. low, high: range, both ends allowed; -inf and inf if scale is "categorical".
    choices: the allowed values if scale is "categorical", else empty. online: it may change between two frames.
    tunable: searches may change it. sees: "pixels" or "points" if it has an effect only with these, else "".
    """

    name: str
    default: Value
    unit: str
    meaning: str
    scale: Scale
    low: float = float("-inf")
    high: float = float("inf")
    choices: tuple[Value, ...] = ()
    online: bool = True
    tunable: bool = True
    sees: str = ""

    @property
    def ours(self) -> bool:
        """True if the meaning says "ours": the parameter belongs to a departure from the tracker's paper."""
        return re.search(r"\bours\b", self.meaning) is not None

    @property
    def expected(self) -> str:
        """The allowed values in words, for error messages: "one of a, b", "an integer from 1 to 5" or "a number from 0
        to 1"."""
        if self.scale == "categorical":
            return "one of " + ", ".join(str(c) for c in self.choices)
        kind = "an integer" if self.scale == "int" else "a number"
        kind = f"{len(self.default)} numbers" if isinstance(self.default, tuple) else kind
        return f"{kind} from {self.low:g} to {self.high:g}"

    def check(self, value: object, file: object = "") -> Value:
        """Return the value as float, as int if scale is "int" (3.0 is allowed), or as a tuple of floats if it is
        "vector"; a choice is returned as it is.

        file: only for the error message, "" for none. Raises InputError if the value has a wrong type (a bool is no
        number), is out of range (both ends are inside), is nan, or is no choice of the same type.
        """
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
        """Return the value that `text` stands for: a choice, else a number, as int if scale is "int", else as float;
        if scale is "vector" numbers, separated by commas.

        True and False may be in lower case. Raises InputError if the text stands for no allowed value.
        """
        for choice in self.choices:
            if text == str(choice) or (isinstance(choice, bool) and text.lower() == str(choice).lower()):
                return choice
        try:
            if self.scale == "vector":
                return self.check([read_number(part) for part in text.strip("[] ").split(",")])
            return self.check(read_number(text))
        except ValueError:
            return self.check(text)


class ParamUse(TypedDict, total=False):
    """Optional keywords of `param`: where and when the parameter is used.

    online: True (default) if it may change between two frames. tunable: True (default) if searches may change it.
    sees: "pixels" or "points" if it has an effect only with these, and searches over others leave it out; "" (default):
    it has an effect with both.
    """

    online: bool
    tunable: bool
    sees: Literal["", "pixels", "points"]


def param(
    default: Value,
    values: tuple[Any, ...],
    unit: str,
    meaning: str,
    scale: Scale = "linear",
    **use: Unpack[ParamUse],
) -> Any:
    """Return a dataclass field that declares a parameter with its default.

    values: (low, high), both allowed, or the choices if scale is "categorical". unit, meaning: texts for the docs.
    scale: how a search moves: "linear" or "log" for numbers, "int" for whole numbers, "categorical" for choices,
    "vector" for a tuple of numbers, which no search moves. use: keywords online, tunable, sees, described at ParamUse.
    The default itself is checked only when a config is created. Raises ValueError if a number has not two `values`.
    """
    categorical = scale == "categorical"
    if scale == "vector":
        use["tunable"] = False
    low, high = (float("-inf"), float("inf")) if categorical else values
    declared = Param("", default, unit, meaning, scale, low, high, values if categorical else (), **use)
    return dataclasses.field(default=default, metadata={"param": declared})


@dataclass(frozen=True)
class Config:
    """Base class of configs. A subclass is a frozen dataclass that sets `tracker` and declares its fields with `param`.

    tracker: name of the tracker, for files and messages. Creating a config converts numbers to float, or to int if the
    scale is "int". It raises InputError if a value is not allowed or if `check` refuses the values together, and
    WorkError if `check` raises anything but a FlockscopeError.
    """

    tracker: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, declared in self.params().items():
            object.__setattr__(self, name, declared.check(getattr(self, name)))
        with user_code(lambda error: tracker_failed(type(self).tracker, "check()", "its parameters", error)):
            self.check()

    def check(self) -> None:
        """Raise InputError if the parameters contradict each other; a subclass overrides this. Here nothing
        is checked."""

    @classmethod
    def params(cls) -> dict[str, Param]:
        """Return all declared parameters by name, in order of the fields, inherited ones first.

        Fields that are not declared with `param` are left out; {} if there is no parameter.
        """
        found = [f for f in dataclasses.fields(cls) if "param" in f.metadata]
        return {f.name: dataclasses.replace(f.metadata["param"], name=f.name) for f in found}

    @classmethod
    def space(cls, *, online: bool = False) -> tuple[Param, ...]:
        """Return the tunable parameters, in order of the fields; with `online` only those that may change between two
        frames."""
        return tuple(p for p in cls.params().values() if p.tunable and (p.online or not online))

    @classmethod
    def known(cls, name: str, file: object = "") -> Param:
        """Return the declared parameter of this name.

        file: only for the error message, "" for none. Raises InputError, with the most similar name, if there is no
        such parameter.
        """
        declared = cls.params()
        if name in declared:
            return declared[name]
        remedy = f"did you mean {closest(name, declared)}?" if declared else "it has no parameters"
        raise InputError(file=file, place=name, got=repr(name), expected=f"a parameter of {cls.tracker}", remedy=remedy)

    @classmethod
    def from_dict(cls, values: Mapping[str, object], file: object = "") -> Self:
        """Return the config with these values by parameter name, and defaults for the others.

        file: only for the error message, "" for none. Raises InputError for unknown names, values that are not allowed,
        and values that contradict each other.
        """
        return cls(**{name: cls.known(name, file).check(value, file) for name, value in values.items()})

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Return the config in a TOML file: optional `tracker = "name"` and a table [params]; the rest has its default.

        Raises InputError if the file cannot be read, is no TOML, is of another tracker, or has unknown keys, or values
        that are not allowed or contradict each other.
        """
        return cls.from_dict(read(path, cls.tracker), path)

    @classmethod
    def preset(cls, name: str) -> Self:
        """Return the preset of this name; "paper" switches every departure from the tracker's paper off.

        It is the file tracking/presets/NAME/TRACKER.toml; parameters that the file lacks have their defaults. Raises
        InputError, with the known names, if the tracker has no such preset.
        """
        return cls.from_toml(preset_file(cls.tracker, name))

    @classmethod
    def load(cls, source: str | Path) -> Self:
        """Return the preset of the name `source` if the tracker has one, else the config in the TOML file `source`.

        A file that has the name of a preset is given with a folder, as ./paper. Raises InputError if there is neither,
        or as `from_toml`.
        """
        return cls.from_toml(file_of(cls.tracker, source))

    def with_set(self, *assignments: str) -> Self:
        """Return a copy with assignments "name=value" applied, from left to right, and checked as a whole at the end.

        A literal "tracker." at the very beginning, whatever the tracker is called, and spaces around name and value are
        ignored; of two values for one name the last counts. Raises InputError for an assignment without "=", an unknown
        name, a value that is not allowed, or values that contradict each other.
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
        """Return the values of all parameters by name, in order of the fields."""
        return {name: getattr(self, name) for name in self.params()}

    def to_toml(self) -> str:
        """Return the text of a TOML file, with the tracker's name and all values, from which `from_toml` reads an equal
        config.
        """
        return toml_text(self.tracker, self.as_dict())

    @classmethod
    def table(cls) -> str:
        """Return all parameters as a Markdown table for the docs: parameter, default, range, unit, meaning.

        The range of a categorical parameter lists its choices; " (log)" follows the range if scale is "log". A column
        for each preset of the tracker follows the default; it is empty where the preset leaves the default.
        """
        named = {name: cls.preset(name).as_dict() for name in presets(cls.tracker)}
        head = ["parameter", "default", *(f"preset `{name}`" for name in named), "range", "unit", "meaning"]
        rows = [head, ["---"] * len(head)]
        for p in cls.params().values():
            changed = [values[p.name] for values in named.values()]
            cells = ["" if value == p.default else str(value) for value in changed]
            rows.append([f"`{p.name}`", str(p.default), *cells, _range(p), p.unit, p.meaning])
        return "\n".join("|---" * len(r) + "|" if r[0] == "---" else "| " + " | ".join(r) + " |" for r in rows) + "\n"


def _range(p: Param) -> str:
    """Returns the range of a parameter, or its choices, as a cell of a Markdown table; " (log)" follows if scale is
    "log"."""
    span = ", ".join(f"`{c}`" for c in p.choices) if p.choices else f"{p.low:g} to {p.high:g}"
    return span + (" (log)" if p.scale == "log" else "")
