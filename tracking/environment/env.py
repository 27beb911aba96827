"""The Gymnasium environment `flockscope/Tuning-v0`: actions set a tracker's parameters, the score is the reward.

An episode tracks one whole sequence. An action sets the parameters to search, each in [-1, 1] (see
tracking.parameter_space). With decision_every=None one action before the first frame sets them all, and the episode is
one step long. Else an action sets those that may change between frames, every `decision_every` frames. Observations are
statistics of the run. A step's reward is S(frames so far) - S(frames before it), S being the objective of
`tracking.evaluate` (mean of HOTA and group_F1), 0 for no frames; the rewards sum to it. `import tracking` registers it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, cast, get_args

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from scenarios.errors import InputError, OrderError
from scenarios.loading.toml_files import did_you_mean
from sim.dataset.generate import LEFT_OUT
from sim.dataset.splits import split_of
from sim.types import DetectionMode, Tracker
from tracking.config import Config
from tracking.environment.observation import NAMES, Observer
from tracking.episodes.episode import Rollout, streams_for
from tracking.episodes.episode_cache import DEFAULT_LIMIT, OpenedSource, SourceCache
from tracking.episodes.sources import Source, SourceSpec, sources
from tracking.parameter_space import Space, decode, decode_and_build, space_of
from tracking.running.detection_mode import choose_mode
from tracking.running.prepare import Params, config_of
from tracking.running.tracker_registry import config_class, find
from tracking.scoring.people import Similarity

RESET_OPTIONS = ("scenario", "seed", "params")
Floats = NDArray[np.float32]


class TuningEnv(gymnasium.Env[Floats, Floats]):
    """Gymnasium environment: an episode is one run of a tracker, an action sets parameters, the reward is gained score.

    An action is float32 (P,) in [-1, 1], one number for each of P parameters. An observation is float32 (K,): K
    statistics of the run in [0, 1].

    State: sources and their cache; of the episode the config, the rollout (the run, None before it starts) and the
    score so far.
    """

    def __init__(
        self, tracker: str | type[Tracker], suite: SourceSpec | Source = "quick", *, seeds: Iterable[int] = range(100),
        set: Iterable[str] = (), detections: DetectionMode | None = None, similarity: Similarity | None = None,
        params: Params = None, decision_every: int | None = None, cache: int = DEFAULT_LIMIT, tracker_seed: int = 0,
    ) -> None:  # fmt: skip
        """Makes the environment; the first episode begins with `reset`.

        Args:
            tracker: Registered name, "file.py:Class", "module:Class" or a class.
            suite: Suite, scenario, TOML file, stored sequences, recording, Sequence, or a list of these.
            seeds: Seeds that scenarios are simulated with.
            set: Settings "key=value" of the scenarios.
            detections: Input of the tracker, the same in all episodes.
            similarity: How people are compared: "ground", "image" or "boxes"; None: by the data.
            params: Parameters that an episode begins with; the tracker's defaults if None.
            decision_every: Frames between two actions; None: one action per episode.
            cache: Bytes of sequences that are kept for later episodes.
            tracker_seed: Seed of trackers that use random numbers.

        Raises:
            InputError: An argument is wrong, no parameter can be searched, a source is unreadable or lacks the
                detections, or simulated sources have seeds of two splits.
        """
        _check_choice("detections", detections, (None, *get_args(DetectionMode)))
        _check_choice("similarity", similarity, (None, *get_args(Similarity)))
        self.tracker = find(tracker)
        self.decision_every, self.tracker_seed, self.similarity = decision_every, tracker_seed, similarity
        self.config_class = config_class(self.tracker, self.tracker.__name__)
        self.defaults = config_of(self.config_class, params)
        self.sources = sources(suite, seeds, set)
        _check_split(self.sources)
        self.mode = _detection_mode(self.tracker, self.sources, detections)
        self.space: Space = _action_parameters(self.config_class, self.mode, decision_every)
        self.cache = SourceCache(cache)
        self.observation_space = Box(0.0, 1.0, (len(NAMES),), np.float32)
        self.action_space = Box(-1.0, 1.0, (len(self.space),), np.float32)
        self.left_out: dict[Source, str] = {}  # and why: scenes whose script does not come true
        self.source, self.base = self.sources[0], self.defaults
        self._clear_episode()

    def _clear_episode(self) -> None:
        self.rollout: Rollout | None = None
        self._observer: Observer | None = None
        self.config, self.score, self.scores, self.refused = self.base, 0.0, dict[str, float](), ""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode on a source that the environment's random generator draws.

        If an error is raised, the previous episode stays the current one.

        Args:
            seed: Seeds the generator anew; None continues with its present state.
            options: "scenario" and "seed" restrict the draw to sources of this name and this seed; "params" are the
                tracker's parameters to begin with.

        Returns:
            The observation, and a dict with scenario, seed, frame (number of frames tracked), objective (0 while
            unknown), scores (by key), names (the action's parameters), params (all values by name), and refused (the
            tracker's message about the last action's config, "" if it was accepted).

        Raises:
            InputError: An option is unknown, no source fits, the source cannot be opened or has no labels, or the
                parameters are refused.
            WorkError: The tracker's own `reset` fails.
        """
        super().reset(seed=seed)
        options = options or {}
        for name in options:
            _check_choice("options", name, RESET_OPTIONS)
        base = self.defaults if options.get("params") is None else config_of(self.config_class, options["params"])
        source, opened = self._open_source(options)
        rollout = None if self.decision_every is None else self._rollout(base, source)
        if rollout is not None and not hasattr(rollout.prepared.tracker, "config"):
            expected, remedy = "a tracker that keeps its config as `config`", "see docs/reference/environment.md"
            raise InputError(place="decision_every", got=self.tracker.__name__, expected=expected, remedy=remedy)
        self.source, self.base = source, base
        self._clear_episode()
        self.rollout, self._observer = rollout, Observer(opened.sequence.fps)
        return self._observe(), self._info()

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Sets the parameters and continues tracking, to the end or for `decision_every` frames.

        Parameters that contradict each other are moved towards those that the episode began with, until they are valid.
        If the tracker refuses a config between two frames, it keeps the previous one. After the end of the sequence, a
        step tracks it again with the new parameters if `decision_every` is None; else it tracks nothing.

        Args:
            action: One number for each parameter, (P,), clipped to [-1, 1].

        Returns:
            The observation; the reward, which is the objective of all frames so far minus the objective before the
            step; True if the sequence has ended; False (never truncated); and a dict as `reset` returns it.

        Raises:
            InputError: Before `reset`, for an action of another shape or not finite, or from the tracker.
            IncomparableError: The tracks cannot be compared with the truth.
            WorkError: The tracker fails.
        """
        if self._observer is None:
            raise InputError(place="step", got="no episode", expected="one that was begun", remedy="call reset() first")
        if self.decision_every is None:
            rollout = decode_and_build(self.space, action, self.base, self._rollout)
            self.rollout, self.config = rollout, cast(Config, rollout.config)
            terminated = self._advance(rollout, None)
        else:
            assert self.rollout is not None
            rollout, config = self.rollout, decode(self.space, action, self.base)
            terminated = self._advance_with(rollout, config, len(rollout.tracks) + self.decision_every)
        self.scores = rollout.scores() if rollout.tracks else {}
        before, self.score = self.score, self.scores.get("objective", 0.0)
        return self._observe(), self.score - before, terminated, False, self._info()

    def _rollout(self, config: Config, source: Source | None = None) -> Rollout:
        return Rollout(
            self.tracker, source or self.source, config, detections=self.mode, tracker_seed=self.tracker_seed,
            cache=self.cache, similarity=self.similarity,
        )  # fmt: skip

    def _advance(self, rollout: Rollout, upto: int | None) -> bool:
        assert self._observer is not None
        for frame, tracks in rollout.advance(upto):
            self._observer.add(frame, tracks)
        done = len(rollout.tracks)
        return done == rollout.length or upto is None or done < upto

    def _advance_with(self, rollout: Rollout, config: Config, upto: int) -> bool:
        tracker = cast(Any, rollout.prepared.tracker)
        before, self.refused = self.config, ""
        self.config = tracker.config = config
        try:
            return self._advance(rollout, upto)
        except InputError as error:
            if before is config:
                raise
            self.config = tracker.config = before
            self.refused = str(error)
            return self._advance(rollout, upto)

    def close(self) -> None:
        """Ends the episode and replaces the cache of sources by an empty one. `reset` may follow."""
        self._clear_episode()
        self.cache = SourceCache(self.cache.limit)

    def _open_source(self, options: Mapping[str, Any]) -> tuple[Source, OpenedSource]:
        """Draws sources until one's script comes true; raises its error if more than 5 % of the sources fail."""
        while True:
            source = self._draw_source(options)
            opened = self.cache.open(source, streams_for(self.tracker, self.mode))
            try:
                assert opened.truth is not None
                return source, opened
            except OrderError as error:
                known = source in self.left_out  # drawn again because nothing else fits the options
                self.left_out[source] = error.line()
                if known or len(self.left_out) > LEFT_OUT * len(self.sources):
                    raise

    def _draw_source(self, options: Mapping[str, Any]) -> Source:
        name, seed = options.get("scenario"), options.get("seed")
        fitting = [s for s in self.sources if name in (None, s.name) and seed in (None, s.seed)]
        fitting = [s for s in fitting if s not in self.left_out] or fitting
        if not fitting:
            names, seeds = sorted({s.name for s in self.sources}), sorted({s.seed for s in self.sources})
            expected = f"one of {', '.join(names)}, with a seed from {seeds[0]} to {seeds[-1]}"
            raise InputError(place="options", got=f"{name}, {seed}", expected=expected, remedy="correct the options")
        return fitting[int(self.np_random.integers(len(fitting)))]

    def _observe(self) -> Floats:
        assert self._observer is not None
        scale = float("nan") if self.rollout is None else self.rollout.prepared.px_per_m(self.rollout.tracks)
        return self._observer.statistics(scale)

    def _info(self) -> dict[str, Any]:
        return {
            "scenario": self.source.name,
            "seed": self.source.seed,
            "frame": 0 if self.rollout is None else len(self.rollout.tracks),
            "objective": self.score,
            "scores": dict(self.scores),
            "names": tuple(p.name for p in self.space),  # of the parameters that the numbers of an action set
            "params": self.config.as_dict(),
            "refused": self.refused,
        }


def _check_split(among: Iterable[Source]) -> None:
    seeds = sorted({s.seed for s in among if s.simulated})
    found = {split_of(range(seed, seed + 1)) for seed in seeds}
    if len(found) > 1:
        got, remedy = f"{seeds[0]} to {seeds[-1]}: {', '.join(sorted(found))}", "give seeds of one split"
        raise InputError(place="seeds", got=got, expected="seeds of one split", remedy=remedy)


def _detection_mode(tracker: type[Tracker], among: tuple[Source, ...], wanted: DetectionMode | None) -> DetectionMode:
    for source in among:
        if not source.simulated:
            wanted = choose_mode(tracker.needs, source.open(("left",)), wanted)
    if any(source.simulated for source in among):
        wanted = wanted or ("image" if streams_for(tracker, None) else "file")
    assert wanted is not None
    return wanted


def _action_parameters(kind: type[Config], mode: DetectionMode, every: int | None) -> Space:
    if every is not None and (not isinstance(every, int | np.integer) or isinstance(every, bool) or every < 1):
        got, expected = repr(every), "a number of frames, 1 or more, or None"
        raise InputError(place="decision_every", got=got, expected=expected, remedy="correct it")
    space = space_of(kind, mode, online=every is not None)
    if not space:
        what = "parameters to search" if every is None else "parameters that may change between frames"
        remedy = "declare some in its config (docs/guides/your-own-tracker.md)"
        raise InputError(place="tracker", got=kind.tracker, expected=f"a tracker with {what}", remedy=remedy)
    return space


def _check_choice(place: str, got: object, known: Iterable[object]) -> None:
    known = tuple(known)
    if got not in known:
        remedy = did_you_mean(str(got), map(str, known), "choose one of them") if known else "remove it"
        raise InputError(place=place, got=repr(got), expected=f"one of {', '.join(map(str, known))}", remedy=remedy)
