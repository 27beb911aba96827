"""An agent that changes a tracker's parameters while it runs: a linear policy on what a tracker in use can see.

Every `every` seconds, the first time before the first frame, the parameters are moved in the cube of
tracking.parameter_space:

    a = a0 + offset + weights s,    s = (o - usual) / spread,

a0 the point of the policy's own config, o the statistics (tracking.environment.observation) of the frames since the
last decision;
before the first frame s = 0. Without weights it is a fixed set of parameters. Found by tracking.agent_search.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from scenarios.errors import InputError
from sim.types import Array, Context, Detections, Frame, Tracker, Tracks
from tracking import image_scale
from tracking.config import Config, Value
from tracking.environment.observation import NAMES, Observer
from tracking.parameter_space import Space, decode, decode_and_build, encode
from tracking.tracker_registry import config_class, find

OWN = ("grouped", "group_size", "merges", "splits")
"""Statistics of groups that the tracker names itself: no part of a policy, which is to serve any tracker."""


@dataclass(frozen=True, eq=False)
class Policy:
    """tracker: its name; every, s between decisions; parameters (P,), those that move, and statistics (F,) they move
    by, names; offset (P,), weights (P, F) in the cube; usual, spread (F,); params: other values than the defaults."""

    tracker: str
    every: float
    parameters: tuple[str, ...]
    statistics: tuple[str, ...]
    offset: Array
    weights: Array
    usual: Array
    spread: Array
    params: Mapping[str, Value] = field(default_factory=dict)

    def __post_init__(self) -> None:
        p, f = len(self.parameters), len(self.statistics)
        known = {q.name for q in config_class(find(self.tracker), self.tracker).space(online=True)}
        for place, names, allowed in (
            ("parameters", self.parameters, known),
            ("statistics", self.statistics, set(NAMES) - set(OWN)),
        ):
            for name in names:
                if name not in allowed:
                    expected = "some of " + ", ".join(sorted(allowed))
                    raise InputError(place=place, got=name, expected=expected, remedy="correct the name")
        if not self.every > 0:
            raise InputError(place="every", got=self.every, expected="more than 0 s", remedy="correct it")
        for name, shape in (("offset", (p,)), ("weights", (p, f)), ("usual", (f,)), ("spread", (f,))):
            value = np.asarray(getattr(self, name), float)
            if value.shape != shape or not np.isfinite(value).all():
                expected = f"finite numbers of shape {shape}"
                raise InputError(place=name, got=f"shape {value.shape}", expected=expected, remedy="correct it")
            object.__setattr__(self, name, value)

    @cached_property
    def base(self) -> Config:
        """The config that it moves."""
        return config_class(find(self.tracker), self.tracker).from_dict(self.params)

    @cached_property
    def space(self) -> Space:
        """The parameters (P,) that it moves, in their order."""
        return tuple(self.base.known(name) for name in self.parameters)

    def frames(self, fps: float) -> int:
        """From one decision to the next."""
        return max(round(self.every * fps), 1)

    def point(self, observed: ArrayLike | None) -> Array:
        """Where the parameters (P,) for the next frames are in the cube, by the statistics (K,) of the last ones; None
        before the first frame."""
        seen = np.zeros(len(self.statistics))
        if observed is not None:
            seen = (np.asarray(observed, float)[[NAMES.index(s) for s in self.statistics]] - self.usual) / self.spread
        return np.asarray(encode(self.space, self.base) + self.offset + self.weights @ seen)

    def config(self, observed: ArrayLike | None) -> Config:
        """The parameters at this point."""
        return decode(self.space, self.point(observed), self.base)

    def to_json(self) -> str:
        """Itself as text."""
        arrays = {k: getattr(self, k).tolist() for k in ("offset", "weights", "usual", "spread")}
        names = {"parameters": self.parameters, "statistics": self.statistics, "params": dict(self.params)}
        return json.dumps({"tracker": self.tracker, "every": self.every, **names, **arrays}, indent=1) + "\n"

    @classmethod
    def from_json(cls, path: str | Path) -> Policy:
        """Read a policy from a file; InputError where it is none."""
        try:
            found = json.loads(Path(path).read_text(encoding="utf-8"))
            found |= {name: tuple(found[name]) for name in ("parameters", "statistics")}
            return cls(**found)
        except (OSError, ValueError, TypeError, KeyError) as error:
            got = f"{type(error).__name__}: {error}".partition("\n")[0]
            remedy = "give a file that Policy.to_json wrote"
            raise InputError(file=path, got=got, expected="a policy", remedy=remedy) from error

    def tracked(self) -> type[Tracker]:
        """A tracker class: the tracker with this policy, for `tracking.track` and everything else that takes one."""
        kind = find(self.tracker)
        return cast(
            "type[Tracker]", type(f"Adaptive{kind.__name__}", (Adaptive,), {"policy": self, "needs": kind.needs})
        )


class Adaptive:
    """A tracker whose parameters a policy moves. State: the tracker, what was seen, the answers so far."""

    policy: ClassVar[Policy]
    needs: ClassVar[tuple[str, ...]]

    def reset(self, context: Context, seed: int) -> None:
        """Begin anew, with the policy's parameters of a run in which nothing was seen yet, as far as the tracker takes
        them for this sequence."""
        self.context = context
        self.long = self.policy.frames(context.fps)
        policy = self.policy

        def begin(config: Config) -> Any:
            tracker = cast(Any, find(policy.tracker))(config)
            tracker.reset(context, seed)
            return tracker

        self.inner: Any
        _, self.inner = decode_and_build(policy.space, policy.point(None), policy.base, begin)
        self.observer, self.answers = Observer(context.fps), list[Tracks]()

    @property
    def px_per_m(self) -> float | None:
        """What the tracker has learned of the scale, if it says so."""
        return getattr(self.inner, "px_per_m", None)

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        """The tracker's answer; before it other parameters, if it is time and the tracker takes them."""
        before = self.inner.config
        if self.answers and len(self.answers) % self.long == 0:
            known = image_scale.from_tracks(self.context.px_per_m, self.px_per_m, self.answers)
            self.inner.config = self.policy.config(self.observer.look(known))
        try:
            answer = cast(Tracks, self.inner.step(frame, detections))
        except InputError:
            if self.inner.config is before:
                raise
            self.inner.config = before
            answer = cast(Tracks, self.inner.step(frame, detections))
        self.observer.see(frame, answer)
        self.answers.append(answer)
        return answer
