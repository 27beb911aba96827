"""How a tracker declares its parameters: one frozen dataclass, from which space, files and docs are derived.

A field is declared as `gate: float = param(0.99, (0.9, 0.9999), "probability", "share of ...")`. Parameters hold
seconds, metres and rates, never frame counts. The search space of `tune`, the action space of the environment (fields
that are `online`: they may change between two frames) and the table in the docs are read from the declarations.
"""

from __future__ import annotations

import dataclasses
import inspect
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest

Scale = Literal["linear", "log", "int", "categorical"]
Value = float | int | str | bool
FROZEN = Path(__file__).parent / "frozen"


@dataclass(frozen=True)
class Param:
    """One declared parameter: default, unit, meaning, and low..high or choices.

    before: of a parameter younger than the frozen first defaults, the value that leaves a tracker as it was without it.
    sees: "pixels" or "points" of one that says something only where the tracker is given these; a search over other
    detections leaves it alone.
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
        """What may stand here, in words."""
        if self.scale == "categorical":
            return "one of " + ", ".join(str(c) for c in self.choices)
        kind = "an integer" if self.scale == "int" else "a number"
        return f"{kind} from {self.low:g} to {self.high:g}"

    def check(self, value: object, file: object = "") -> Value:
        """The value in the parameter's own type, or InputError."""
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
        """The value written as `text`, or InputError."""
        for choice in self.choices:
            if text == str(choice) or (isinstance(choice, bool) and text.lower() == str(choice).lower()):
                return choice
        try:
            return self.check(float(text))
        except ValueError:
            return self.check(text)


def param(
    default: Value,
    values: tuple[Any, ...],
    unit: str,
    meaning: str,
    scale: Scale = "linear",
    *,
    online: bool = True,
    tunable: bool = True,
    before: Value | None = None,
    sees: Literal["", "pixels", "points"] = "",
) -> Any:
    """A dataclass field that is a parameter; `values` is (low, high), or the choices of a categorical one."""
    ends = {"choices": values} if scale == "categorical" else {"low": values[0], "high": values[1]}
    spec = {"default": default, "unit": unit, "meaning": meaning, "scale": scale, **ends}
    spec |= {"online": online, "tunable": tunable, "before": before, "sees": sees}
    return dataclasses.field(default=default, metadata={"param": spec})


@dataclass(frozen=True)
class Config:
    """Base of all tracker configs; a subclass sets `tracker` and declares its parameters."""

    tracker: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for name, declared in self.params().items():
            object.__setattr__(self, name, declared.check(getattr(self, name)))
        self.check()

    def check(self) -> None:
        """Conditions between parameters (a subclass overrides); InputError when broken."""

    @classmethod
    def params(cls) -> dict[str, Param]:
        """All declared parameters by name, in order."""
        found = [f for f in dataclasses.fields(cls) if "param" in f.metadata]
        return {f.name: Param(name=f.name, **f.metadata["param"]) for f in found}

    @classmethod
    def space(cls, *, online: bool = False) -> tuple[Param, ...]:
        """The search space: tunable parameters; with `online`, those that may change between frames."""
        return tuple(p for p in cls.params().values() if p.tunable and (p.online or not online))

    @classmethod
    def known(cls, name: str, file: object = "") -> Param:
        """The parameter of this name; InputError with the nearest known name."""
        declared = cls.params()
        if name in declared:
            return declared[name]
        remedy = f"did you mean {closest(name, declared)}?" if declared else "it has no parameters"
        raise InputError(file=file, place=name, got=name, expected=f"a parameter of {cls.tracker}", remedy=remedy)

    @classmethod
    def from_dict(cls, values: Mapping[str, object], file: object = "") -> Self:
        """The config with these values, the rest at their defaults."""
        return cls(**{name: cls.known(name, file).check(value, file) for name, value in values.items()})

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Read `tracker = "name"` (optional) and the table [params]; what the file leaves out has its default."""
        return cls.from_dict(cls._values(path), path)

    @classmethod
    def frozen(cls) -> Self:
        """The defaults as they were first written, tracking/frozen/NAME.toml, against which tuning is judged.

        Parameters that came later have their `before`; those that the config inherits, their default.
        """
        path = FROZEN / f"{cls.tracker}.toml"
        first = cls._values(path)
        own = inspect.get_annotations(cls)
        later = {n: p.before if n in own else p.default for n, p in cls.params().items() if n not in first}
        assert None not in later.values(), f"a parameter that {path.name} lacks declares what it was before: {later}"
        return cls.from_dict(first | later, path)

    @classmethod
    def _values(cls, path: str | Path) -> dict[str, object]:
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
        """A copy with `name=value` assignments applied; `tracker.name=value` means the same."""
        changes: dict[str, Any] = {}
        for assignment in assignments:
            name, sign, text = assignment.removeprefix("tracker.").partition("=")
            if not sign:
                remedy = "write --set tracker.NAME=VALUE"
                raise InputError(place="--set", got=assignment, expected="name=value", remedy=remedy)
            changes[name.strip()] = self.known(name.strip(), "--set").parse(text.strip())
        return dataclasses.replace(self, **changes)

    def as_dict(self) -> dict[str, Value]:
        """Parameter values by name."""
        return {name: getattr(self, name) for name in self.params()}

    def to_toml(self) -> str:
        """A file that `from_toml` reads back equal."""
        lines = [f"{name} = {_toml(value)}" for name, value in self.as_dict().items()]
        return "\n".join([f'tracker = "{self.tracker}"', "", "[params]", *lines, ""])

    @classmethod
    def table(cls) -> str:
        """The parameters as a Markdown table for the docs."""
        rows = [_row(p) for p in cls.params().values()]
        return "\n".join(["| parameter | default | range | unit | meaning |", "|---|---|---|---|---|", *rows, ""])


def _row(p: Param) -> str:
    span = ", ".join(f"`{c}`" for c in p.choices) if p.choices else f"{p.low:g} to {p.high:g}"
    note = " (log)" if p.scale == "log" else ""
    return f"| `{p.name}` | {p.default} | {span}{note} | {p.unit} | {p.meaning} |"


def _toml(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def _read(path: str | Path) -> str:
    try:
        return Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        got = getattr(error, "strerror", None) or "no UTF-8 text"
        raise InputError(file=path, got=got, expected="a parameter file", remedy="check the path") from None
