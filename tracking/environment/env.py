"""`flockscope/Tuning-v0`: a tracker's parameters as actions, statistics of its run as observations (Gymnasium).

An episode is a sequence, tracked from the first frame to the last. An action sets the parameters to be searched, each
in [-1, 1] (tracking.parameter_space): once, before the first frame (decision_every=None, one step long), or those that
may
change between frames every so many frames. The reward of a step is S(frames so far) - S(frames before), S being the
objective of `tracking.evaluate` and 0 for no frames: rewards sum to the objective. Registered by `import tracking`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, cast, get_args

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from scenarios.errors import InputError
from scenarios.loading.toml_files import closest
from sim.types import DetectionMode, Image, Tracker
from tracking.config import Config
from tracking.detection_mode import choose_mode
from tracking.environment.episode_cache import LIMIT, Cache
from tracking.environment.episodes import AnyTracker, Rollout, streams_for
from tracking.environment.observation import NAMES, Observer
from tracking.episode_source import Source, SourceSpec, sources
from tracking.parameter_space import Space, decode, decode_and_build, encode, space_of
from tracking.prepare import Params, config_of
from tracking.tracker_registry import checked, config_class, find

METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}
SEEN = ("statistics", "parameters", "none")
OPTIONS = ("scenario", "seed", "params")
Observation = Literal["statistics", "parameters", "none"]
Floats = NDArray[np.float32]


class TuningEnv(gymnasium.Env[Floats, Floats]):
    """The environment. State: the sources, some of them opened; of the episode: source, parameters, rollout, score.

    tracker: a registered one, "file.py:Class", "module:Class" or a class. suite: a suite, a scenario, a TOML file, a
    folder of stored sequences, a Sequence, or a list of these: scenarios with each of `seeds`, and with the settings
    `set`. detections: as for `tracking.track`. params: what an episode begins with. decision_every: frames between two
    actions, None: one action for the whole episode. observation: "statistics", "parameters" (these, and where the
    parameters are in [-1, 1]) or "none" (a 0). cache: bytes of motions and detections that are kept for further
    episodes. tracker_seed: for trackers that draw.
    """

    metadata = METADATA

    def __init__(
        self,
        tracker: AnyTracker,
        suite: SourceSpec | Source = "quick",
        *,
        seeds: Iterable[int] = range(100),
        set: Iterable[str] = (),
        detections: DetectionMode | None = None,
        params: Params = None,
        decision_every: int | None = None,
        observation: Observation = "statistics",
        cache: int = LIMIT,
        tracker_seed: int = 0,
        render_mode: str | None = None,
    ) -> None:
        self.tracker: type[Tracker] = find(tracker) if isinstance(tracker, str) else checked(tracker, str(tracker))
        self.tracker_seed, self.decision_every = tracker_seed, decision_every
        _one_of("observation", observation, SEEN)
        _one_of("detections", detections, (None, *get_args(DetectionMode)))
        _one_of("render_mode", render_mode, (None, *METADATA["render_modes"]))
        self.render_mode, self.observation = render_mode, observation
        self.kind = config_class(self.tracker, self.tracker.__name__)
        self.defaults = config_of(self.kind, params)
        self.sources = sources(suite, seeds, set)
        self.mode = _mode(self.tracker, self.sources, detections)
        self.space: Space = _space(self.kind, self.mode, decision_every)
        self.cache = Cache(cache)
        count, low = len(NAMES), np.r_[np.zeros(len(NAMES)), -np.ones(len(self.space))].astype(np.float32)
        size = {"statistics": count, "parameters": len(low), "none": 1}[observation]
        self.observation_space = Box(low[:size], np.ones(size, np.float32))
        self.action_space = Box(-1.0, 1.0, (len(self.space),), np.float32)
        self.source, self.base = self.sources[0], self.defaults
        self.metadata = self._metadata(self.source.fps)
        self._forget()

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """What each number of an action sets."""
        return tuple(p.name for p in self.space)

    @property
    def observation_names(self) -> tuple[str, ...]:
        """What each number of an observation is."""
        names = {"statistics": NAMES, "parameters": (*NAMES, *self.parameter_names), "none": ("nothing",)}
        return names[self.observation]

    def _metadata(self, fps: float) -> dict[str, Any]:
        """A video of pictures, one per action, takes as long as what it shows."""
        return {**METADATA, "render_fps": max(round(fps / (self.decision_every or 1)), 1)}

    def _forget(self) -> None:
        """No episode."""
        self.rollout: Rollout | None = None
        self._observer: Observer | None = None
        self.config, self.score, self.scores, self.refused = self.base, 0.0, dict[str, float](), ""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode on a source that the env's own generator draws.

        options: "scenario" and "seed" leave only sources of this name and seed to be drawn from; "params": what this
        episode begins with. InputError for others, for parameters that the tracker refuses, and for a source that
        cannot be scored.
        """
        super().reset(seed=seed)
        options = options or {}
        for name in options:
            _one_of("options", name, OPTIONS)
        base = self.defaults if options.get("params") is None else config_of(self.kind, options["params"])
        source = self._drawn(options)
        held = self.cache.hold(source, streams_for(self.tracker, self.mode))
        assert held.truth is not None
        rollout = None if self.decision_every is None else self._begun(base, source)
        if rollout is not None and not hasattr(rollout.ready.tracker, "config"):
            expected, remedy = "a tracker that keeps its config as `config`", "see docs/tuning.md, Environment"
            raise InputError(place="decision_every", got=self.tracker.__name__, expected=expected, remedy=remedy)
        self.source, self.base = source, base
        self._forget()
        self.rollout, self._observer = rollout, Observer(held.sequence.fps)
        self.metadata = self._metadata(held.sequence.fps)
        return self._observed(), self._info()

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Set the parameters and track on: to the end, or `decision_every` frames.

        Parameters that are no config are drawn back towards those that the episode began with
        (tracking.parameter_space.decode);
        those that the tracker refuses between frames leave it with the ones before, and `info["refused"]` says why.
        """
        if self._observer is None:
            raise InputError(place="step", got="no episode", expected="one that was begun", remedy="call reset() first")
        if self.decision_every is None:
            self.config, rollout = decode_and_build(
                self.space, action, self.base, lambda c: self._begun(c, self.source)
            )
            self.rollout = rollout
            whole = self._track(None)
        else:
            assert self.rollout is not None
            whole = self._track_on(decode(self.space, action, self.base))
        self.scores = self.rollout.scores() if self.rollout.answers else {}
        before, self.score = self.score, self.scores.get("objective", 0.0)
        return self._observed(), self.score - before, whole, False, self._info()

    def _begun(self, config: Config, source: Source) -> Rollout:
        return Rollout(
            self.tracker, source, config, detections=self.mode, tracker_seed=self.tracker_seed, cache=self.cache
        )

    def _track(self, upto: int | None) -> bool:
        """Track on; is this the end?"""
        assert self.rollout is not None
        for frame, answer in self.rollout.advance(upto):
            if self.observation != "none":
                assert self._observer is not None
                self._observer.see(frame, answer)
        done = len(self.rollout.answers)
        return done == self.rollout.length or upto is None or done < upto

    def _track_on(self, config: Config) -> bool:
        """Track `decision_every` frames with these parameters; with those before where the tracker refuses them."""
        assert self.rollout is not None
        assert self.decision_every is not None
        upto = len(self.rollout.answers) + self.decision_every
        tracker = cast(Any, self.rollout.ready.tracker)
        before, self.refused = self.config, ""
        self.config = tracker.config = config
        try:
            return self._track(upto)
        except InputError as error:
            if before is config:
                raise
            self.config = tracker.config = before
            self.refused = str(error)
            return self._track(upto)

    def render(self) -> Image | None:
        """The last frame with what is tracked in it, RGB; None without a render_mode."""
        if self.render_mode is None:
            return None
        from tracking.environment.picture import picture

        return picture(self.cache.hold(self.source, streams_for(self.tracker, self.mode)), self.rollout, self.score)

    def close(self) -> None:
        """Let go of what is held."""
        self._forget()
        self.cache = Cache(self.cache.limit)

    def _drawn(self, options: Mapping[str, Any]) -> Source:
        name, seed = options.get("scenario"), options.get("seed")
        fits = [s for s in self.sources if name in (None, s.name) and seed in (None, s.seed)]
        if not fits:
            names, seeds = sorted({s.name for s in self.sources}), sorted({s.seed for s in self.sources})
            expected = f"one of {', '.join(names)}, with a seed from {seeds[0]} to {seeds[-1]}"
            raise InputError(place="options", got=f"{name}, {seed}", expected=expected, remedy="correct the options")
        return fits[int(self.np_random.integers(len(fits)))]

    def _observed(self) -> Floats:
        if self.observation == "none":
            return np.zeros(1, np.float32)
        assert self._observer is not None
        scale = float("nan") if self.rollout is None else self.rollout.ready.px_per_m(self.rollout.answers)
        seen = self._observer.look(scale)
        if self.observation == "statistics":
            return seen
        return np.concatenate([seen, encode(self.space, self.config).astype(np.float32)])

    def _info(self) -> dict[str, Any]:
        return {
            "scenario": self.source.name,
            "seed": self.source.seed,
            "frame": 0 if self.rollout is None else len(self.rollout.answers),
            "objective": self.score,
            "scores": dict(self.scores),
            "names": self.parameter_names,
            "params": self.config.as_dict(),
            "refused": self.refused,
        }


def _mode(tracker: type[Tracker], among: Iterable[Source], asked: DetectionMode | None) -> DetectionMode:
    """The detections of all episodes, so that all have the same parameters: those of the first that is not simulated;
    InputError where another one has none of the kind."""
    among = tuple(among)
    for source in among:
        if not source.simulated:
            asked = choose_mode(tracker.needs, source.open(("left",)), asked)
    if any(source.simulated for source in among):
        asked = asked or ("image" if streams_for(tracker, None) else "file")
    assert asked is not None
    return asked


def _space(kind: type[Config], mode: DetectionMode, every: int | None) -> Space:
    if every is not None and (not isinstance(every, int | np.integer) or isinstance(every, bool) or every < 1):
        got, expected = repr(every), "a number of frames, 1 or more, or None"
        raise InputError(place="decision_every", got=got, expected=expected, remedy="correct it")
    space = space_of(kind, mode, online=every is not None)
    if not space:
        what = "parameters to search" if every is None else "parameters that may change between frames"
        remedy = "declare some in its config (docs/trackers.md)"
        raise InputError(place="tracker", got=kind.tracker, expected=f"a tracker with {what}", remedy=remedy)
    return space


def _one_of(place: str, got: object, known: Iterable[object]) -> None:
    known = tuple(known)
    if got not in known:
        remedy = f"did you mean {closest(str(got), map(str, known))}?" if known else "leave it out"
        raise InputError(place=place, got=repr(got), expected=f"one of {', '.join(map(str, known))}", remedy=remedy)
