"""A policy: parameters of a tracker that follow what it sees of its input, without any truth (ours).

Every `every` s each parameter p takes the residual a_p = clip(b_p + sum_s w_ps o_s, -limit, limit) from the config that
it begins with (`parameter_space.moved`). o_s are the statistics of `tracking.running.signals` of the frames since the
last decision, averaged over time: o <- o + (1 - exp(-every / memory)) (new - o). Before frame 1, where nothing is seen
and all statistics are 0, residuals are 0; the first average is the first new value. The same numbers come from a live
run.

A policy is a TOML file that can be read and edited:

    tracker = "blob"
    every = 1.0
    memory = 3.0
    limit = 0.4

    [params]               # the config it begins with
    position_noise = 0.12

    [policy.position_noise]
    bias = -0.1
    residual = 0.8
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import is_number
from scenarios.loading.toml_files import did_you_mean, parse
from sim.types import Array, Frame, Tracker, Tracks
from tracking.config import Config, Param, require_tracker
from tracking.parameter_space import decode, moved
from tracking.running.signals import NAMES, Signals

BIAS = "bias"
LARGEST = 1000.0  # weight


@dataclass(frozen=True)
class Policy:
    """A linear policy of a tracker.

    base: the config that it begins with. every: s between two decisions. memory: s over which statistics are averaged;
    0: they are not. weights: by parameter a weight by name of a statistic, and "bias"; those that are absent are 0.
    limit: of a residual.
    """

    base: Config
    every: float
    memory: float
    weights: Mapping[str, Mapping[str, float]]
    limit: float = 1.0

    def __post_init__(self) -> None:
        kind = type(self.base)
        for place, value, low in (("every", self.every, 0.01), ("memory", self.memory, 0.0)):
            if not is_number(value, low, 3600.0):
                expected = f"seconds from {low:g} to 3600"
                raise InputError(place=place, got=repr(value), expected=expected, remedy="correct it")
        if not is_number(self.limit, 0.0, 1.0):
            expected = "a number from 0 to 1"
            raise InputError(place="limit", got=repr(self.limit), expected=expected, remedy="correct it")
        for name, row in self.weights.items():
            if not kind.known(name).online:
                expected, remedy = "a parameter that may change between frames", "remove it"
                raise InputError(place=f"policy.{name}", got=repr(name), expected=expected, remedy=remedy)
            for signal, weight in row.items():
                if signal not in (BIAS, *NAMES):
                    got, remedy = repr(signal), did_you_mean(signal, (BIAS, *NAMES))
                    raise InputError(place=f"policy.{name}", got=got, expected="a statistic, or bias", remedy=remedy)
                if not is_number(weight, -LARGEST, LARGEST):
                    place, expected = f"policy.{name}.{signal}", f"a number within {LARGEST:g}"
                    raise InputError(place=place, got=repr(weight), expected=expected, remedy="correct it")

    @property
    def space(self) -> tuple[Param, ...]:
        """The parameters (P,) that it sets, in the order of the config."""
        return tuple(p for p in type(self.base).space(online=True) if p.name in self.weights)

    def residual(self, seen: Array) -> Array:
        """Returns the residual (P,) of each parameter of `space`, given the averaged statistics (K,); 0 where these are
        0, which is before frame 1."""
        if not seen.any():
            return np.zeros(len(self.space))
        rows = [self.weights[p.name] for p in self.space]
        matrix = np.array([[row.get(name, 0.0) for name in NAMES] for row in rows]).reshape(len(rows), len(NAMES))
        # as a sum along rows, whose order does not depend on the processor as that of a matrix product may
        found = (matrix * seen[None]).cumsum(axis=1)[:, -1] + [row.get(BIAS, 0.0) for row in rows]
        return np.asarray(np.clip(found, -self.limit, self.limit))

    def config(self, seen: Array) -> Config:
        """Returns the config, given the averaged statistics (K,)."""
        return decode(self.space, moved(self.space, self.residual(seen), self.base), self.base)

    def as_dict(self) -> dict[str, Any]:
        """Returns what run.json says of it."""
        weights = {name: dict(row) for name, row in self.weights.items()}
        return {"every": self.every, "memory": self.memory, "limit": self.limit, "weights": weights}

    def to_toml(self) -> str:
        """Returns the text of a file from which `read_policy` reads an equal policy."""
        tracker, *params = self.base.to_toml().splitlines()
        lines = [tracker, f"every = {self.every}", f"memory = {self.memory}", f"limit = {self.limit}", *params]
        for name, row in self.weights.items():
            if row:
                lines += ["", f"[policy.{name}]", *(f"{signal} = {weight}" for signal, weight in row.items())]
        return "\n".join([*lines, ""])


def read_policy(kind: type[Config], path: str | Path) -> Policy | None:
    """Returns the policy in a TOML file; None if it is a file of parameters alone. Raises InputError if the file cannot
    be read, is of another tracker, or wrong."""
    content = parse(Path(path))
    if "policy" not in content:
        return None
    name, rows = content.pop("tracker", kind.tracker), content.pop("policy")
    every, memory, limit = content.pop("every", 1.0), content.pop("memory", 0.0), content.pop("limit", 1.0)
    values = content.pop("params", {})
    require_tracker(name, kind.tracker, path)
    tables = (values, rows, *(rows.values() if isinstance(rows, dict) else ()))
    if content or not all(isinstance(table, dict) for table in tables):
        got, remedy = ", ".join(content) or "policy", "see docs/reference/tuning.md"
        raise InputError(
            file=path, got=got, expected="tracker, every, memory, limit, [params], [policy.…]", remedy=remedy
        )
    try:
        return Policy(kind.from_dict(values, path), every, memory, rows, limit)
    except InputError as error:
        raise (error if error.file else error.replaced(file=path)) from None


def require_config(tracker: Tracker, place: str) -> None:
    """Raises InputError, about `place`, if a tracker keeps no config that could be replaced between two frames."""
    if not hasattr(tracker, "config"):
        expected, remedy = "a tracker that keeps its config as `config`", "see docs/reference/environment.md"
        raise InputError(place=place, got=type(tracker).__name__, expected=expected, remedy=remedy)


@dataclass(eq=False)
class FollowedPolicy:
    """A policy on a run. State: signals, of the frames since the last decision; seen, their averages (K,), None before
    the first; frames, since the run began."""

    policy: Policy
    fps: float
    px_per_m: float  # nan if it is unknown
    signals: Signals = field(init=False)
    seen: Array | None = None
    frames: int = 0

    def begin(self, tracker: Tracker) -> None:
        """Begins a run of a tracker. Raises InputError if it keeps no config that could be changed."""
        require_config(tracker, "policy")
        self.signals, self.seen, self.frames = Signals(self.fps), None, 0

    @property
    def steps(self) -> int:
        """Frames from one decision to the next."""
        return max(round(self.policy.every * self.fps), 1)

    def before(self, tracker: Tracker) -> None:
        """Sets the tracker's config before its next frame, if a decision is due. A config that it refuses in `step` is
        an error of the policy."""
        if self.frames % self.steps == 0:
            new = self.signals.statistics(self.px_per_m).astype(float)
            self.seen = averaged(self.seen, new, self.policy)
            config: Any = self.policy.config(self.seen)
            here: Any = tracker
            if here.config != config:
                here.config = config

    def after(self, frame: Frame, tracks: Tracks) -> None:
        """Takes a frame and its tracks."""
        self.signals.add(frame, tracks)
        self.frames += 1


def averaged(before: Array | None, new: Array, policy: Policy) -> Array:
    """Returns the averages (K,) after new statistics (K,); before: those until then, None or 0 at first."""
    if before is None or not before.any() or not policy.memory:
        return new
    return np.asarray(before + (1.0 - math.exp(-policy.every / policy.memory)) * (new - before))
