"""How a tracker declares its parameters: a frozen dataclass, from which search space, files and docs table are derived.

A field is declared as `gate: float = param(0.99, (0.9, 0.9999), "probability", "share of ...")`. Parameters are
seconds, metres and rates, never frame counts. The search space of `tune`, the action space of the environment and the
table in the docs are read from the declarations.
"""

from __future__ import annotations

import dataclasses
import inspect
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Self, TypedDict, Unpack

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest

Scale = Literal["linear", "log", "int", "categorical"]
Value = float | int | str | bool
FROZEN = Path(__file__).parent / "frozen"
"""Folder of the first defaults of each tracker, NAME.toml."""


@dataclass(frozen=True)
class Param:
    """One declared parameter.

    low, high: range, both ends allowed; choices: the allowed values if scale is "categorical". online, tunable, before,
    sees: see ParamUse.
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
    before: Value | None = None
    sees: str = ""

    @property
    def expected(self) -> str:
        """The allowed values in words, for error messages."""
        if self.scale == "categorical":
            return "one of " + ", ".join(str(c) for c in self.choices)
        kind = "an integer" if self.scale == "int" else "a number"
        return f"{kind} from {self.low:g} to {self.high:g}"

    def check(self, value: object, file: object = "") -> Value:
        """Return the value as float, or as int if scale is "int"; a choice is returned as it is.

        Raises InputError, naming `file`, if the value has a wrong type, is out of range or is no choice.
        """
        if self.scale == "categorical":
            if any(type(value) is type(c) and value == c for c in self.choices):
                return value  # type: ignore[return-value]
        elif isinstance(value, int | float) and not isinstance(value, bool) and self.low <= value <= self.high:
            if self.scale != "int":
                return float(value)
            if value == int(value):
                return int(value)
        remedy = f"the default is {self.default}"
        raise InputError(file=file, place=self.name, got=repr(value), expected=self.expected, remedy=remedy)

    def parse(self, text: str) -> Value:
        """Return the value that `text` stands for. Raises InputError if it stands for no allowed value."""
        for choice in self.choices:
            if text == str(choice) or (isinstance(choice, bool) and text.lower() == str(choice).lower()):
                return choice
        try:
            return self.check(float(text))
        except ValueError:
            return self.check(text)


class ParamUse(TypedDict, total=False):
    """Optional keywords of `param`: where and when the parameter is used.

    online: True (default) if it may change between two frames. tunable: True (default) if searches may change it.
    before: for a parameter that is missing in the frozen first defaults, the value with which the tracker behaves as it
    did then. sees: "pixels" or "points" if it has an effect only with these; searches over others leave it out.
    """

    online: bool
    tunable: bool
    before: Value | None
    sees: Literal["", "pixels", "points"]


def param(
    default: Value,
    values: tuple[Any, ...],
    unit: str,
    meaning: str,
    scale: Scale = "linear",
    **use: Unpack[ParamUse],
) -> Any:
    """Return a dataclass field that declares a parameter.

    values: (low, high), or the choices if scale is "categorical". unit, meaning: for the docs. scale: how a search
    moves: "linear" or "log" for numbers, "int" for whole numbers.
    """
    categorical = scale == "categorical"
    low, high = (float("-inf"), float("inf")) if categorical else values
    declared = Param("", default, unit, meaning, scale, low, high, values if categorical else (), **use)
    return dataclasses.field(default=default, metadata={"param": declared})


@dataclass(frozen=True)
class Config:
    """Base class of configs. A subclass is a frozen dataclass that sets `tracker` and declares its parameters.

    Raises InputError when created with a value that is not allowed or if `check` refuses the values together.
    """

    tracker: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, declared in self.params().items():
            object.__setattr__(self, name, declared.check(getattr(self, name)))
        self.check()

    def check(self) -> None:
        """Raise InputError if the parameters contradict each other; a subclass overrides this."""

    @classmethod
    def params(cls) -> dict[str, Param]:
        """Return all declared parameters by name, in order."""
        found = [f for f in dataclasses.fields(cls) if "param" in f.metadata]
        return {f.name: dataclasses.replace(f.metadata["param"], name=f.name) for f in found}

    @classmethod
    def space(cls, *, online: bool = False) -> tuple[Param, ...]:
        """Return the tunable parameters; with `online` only those of them that may change between two frames."""
        return tuple(p for p in cls.params().values() if p.tunable and (p.online or not online))

    @classmethod
    def known(cls, name: str, file: object = "") -> Param:
        """Return the parameter of this name. Raises InputError with the nearest known name if there is none."""
        declared = cls.params()
        if name in declared:
            return declared[name]
        remedy = f"did you mean {closest(name, declared)}?" if declared else "it has no parameters"
        raise InputError(file=file, place=name, got=name, expected=f"a parameter of {cls.tracker}", remedy=remedy)

    @classmethod
    def from_dict(cls, values: Mapping[str, object], file: object = "") -> Self:
        """Return the config with these values and defaults for the others.

        Raises InputError, naming `file`, for unknown names and values that are not allowed.
        """
        return cls(**{name: cls.known(name, file).check(value, file) for name, value in values.items()})

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Return the config in a TOML file: optional `tracker = "name"` and a table [params]; the rest has its default.

        Raises InputError if the file cannot be read, is of another tracker, or has wrong keys or values.
        """
        return cls.from_dict(cls._values(path), path)

    @classmethod
    def frozen(cls) -> Self:
        """Return the first defaults of the tracker, from tracking/frozen/NAME.toml, against which tuning is judged.

        A parameter that the file lacks has its `before` if the class declares it, and its default if it is inherited.
        Raises AssertionError if a declared one has no `before`, and InputError if the file is missing or wrong.
        """
        path = FROZEN / f"{cls.tracker}.toml"
        first = cls._values(path)
        own = inspect.get_annotations(cls)
        later = {n: p.before if n in own else p.default for n, p in cls.params().items() if n not in first}
        assert None not in later.values(), f"a parameter that {path.name} lacks declares what it was before: {later}"
        return cls.from_dict(first | later, path)

    @classmethod
    def _values(cls, path: str | Path) -> dict[str, object]:
        """The table [params] of a file, unchecked; InputError if the file is no parameter file of this tracker."""
        text = _read(path)
        try:
            content = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(file=path, got=str(error), expected="TOML", remedy="correct the file") from None
        name = content.pop("tracker", cls.tracker)
        if name != cls.tracker:
            remedy = "give the file to the tracker it was made for"
            raise InputError(file=path, place="tracker", got=name, expected=cls.tracker, remedy=remedy)
        values = content.pop("params", {})
        if content or not isinstance(values, dict):
            got, remedy = ", ".join(content) or "params", "put the parameters under [params]"
            raise InputError(file=path, got=got, expected="tracker and [params]", remedy=remedy)
        return values

    def with_set(self, *assignments: str) -> Self:
        """Return a copy with assignments `name=value`, or `tracker.name=value`, applied.

        Raises InputError for an assignment without "=", an unknown name or a value that is not allowed.
        """
        changes: dict[str, Any] = {}
        for assignment in assignments:
            name, sign, text = assignment.removeprefix("tracker.").partition("=")
            if not sign:
                remedy = "write --set tracker.NAME=VALUE"
                raise InputError(place="--set", got=assignment, expected="name=value", remedy=remedy)
            changes[name.strip()] = self.known(name.strip(), "--set").parse(text.strip())
        return dataclasses.replace(self, **changes)

    def as_dict(self) -> dict[str, Value]:
        """Return the parameters' values by name."""
        return {name: getattr(self, name) for name in self.params()}

    def to_toml(self) -> str:
        """Return the text of a TOML file from which `from_toml` reads an equal config."""
        lines = [f"{name} = {_toml(value)}" for name, value in self.as_dict().items()]
        return "\n".join([f'tracker = "{self.tracker}"', "", "[params]", *lines, ""])

    @classmethod
    def table(cls) -> str:
        """Return the parameters as a Markdown table for the docs."""
        rows = [_row(p) for p in cls.params().values()]
        return "\n".join(["| parameter | default | range | unit | meaning |", "|---|---|---|---|---|", *rows, ""])


def _row(p: Param) -> str:
    """A parameter's row of the Markdown table."""
    span = ", ".join(f"`{c}`" for c in p.choices) if p.choices else f"{p.low:g} to {p.high:g}"
    note = " (log)" if p.scale == "log" else ""
    return f"| `{p.name}` | {p.default} | {span}{note} | {p.unit} | {p.meaning} |"


def _toml(value: Value) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _read(path: str | Path) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        got = getattr(error, "strerror", None) or "no UTF-8 text"
        raise InputError(file=path, got=got, expected="a parameter file", remedy="check the path") from None
