"""The Gymnasium environment `flockscope/Tuning-v0`: actions set a tracker's parameters, its score is the reward.

An episode tracks one whole sequence. With decision_every=None one action before the first frame sets the parameters,
and the episode is one step long. Else an action sets those that may change between frames, every `decision_every`
frames. Observations are statistics of the run, which need no truth (`tracking.running.signals`), and the present
parameters. S is the objective of `tracking.evaluate` (mean of HOTA and group_F1).

    reward="window"    S(the frames since the last decision and `margin` s before them) times their share of all frames
    reward="prefix"    S(frames so far) - S(frames before the step); the rewards sum to the objective, but one reward
                       tells little of one decision: use no discount (gamma = 1)

In an episode of one step both are the objective. `import tracking` registers the environment.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Literal, cast, get_args

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray

from scenarios.errors import InputError, OrderError, WorkError
from scenarios.limits import is_number, is_whole
from scenarios.loading.toml_files import did_you_mean
from sim.dataset.generate import LEFT_OUT
from sim.dataset.splits import split_of
from sim.types import DetectionMode, Tracker
from tracking.config import Config
from tracking.episodes.episode import AnyTracker, Episode, Rollout, streams_for
from tracking.episodes.episode_cache import DEFAULT_LIMIT, OpenedSource, SourceCache
from tracking.episodes.sources import Source, SourceSpec, sources
from tracking.parameter_space import Space, decode_and_build, encode, moved, space_of
from tracking.running.detection_mode import choose_mode, modes_of
from tracking.running.policy import require_config
from tracking.running.prepare import Params, config_of
from tracking.running.signals import NAMES, Signals
from tracking.running.time_limit import TimeLimited
from tracking.running.tracker_registry import config_class, find
from tracking.scoring.people import Similarity

Actions = Literal["residual", "absolute", "presets"]
Reward = Literal["window", "prefix"]
RESET_OPTIONS = ("scenario", "seed", "params")
MARGIN = 1.0  # s before a window whose frames are scored with it, so that identities across its edge count
Floats = NDArray[np.float32]


class TuningEnv(gymnasium.Env[Floats, Any]):
    """Gymnasium environment: an episode is one run of a tracker, an action sets parameters, the reward is its score.

    An action is float32 (P,) in [-1, 1], one number for each of P parameters, or the number of a preset. An observation
    is float32 (K + P,): K statistics of the run in [0, 1], and the present parameters in [-1, 1].

    State: sources and their cache; of the episode the config, the rollout (the run, None before it starts) and the
    score so far.
    """

    def __init__(
        self, tracker: AnyTracker, suite: SourceSpec | Source = "quick", *, seeds: Iterable[int] = range(100),
        set: Iterable[str] = (), detections: DetectionMode | None = None, similarity: Similarity | None = None,
        params: Params = None, decision_every: int | None = None, actions: Actions = "residual",
        presets: Iterable[Params] = (), reward: Reward = "window", margin: float = MARGIN, every_score: bool = False,
        cache: int | SourceCache = DEFAULT_LIMIT, tracker_seed: int = 0,
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
            actions: "residual": 0 stands for the parameters that an episode begins with, -1 and 1 for the ends of their
                ranges; "absolute": -1 and 1 are the ends, whatever the episode begins with; "presets": a number chooses
                one of `presets`.
            presets: Parameters to choose from.
            reward: "window" or "prefix".
            margin: Of a window, s.
            every_score: True computes all scores of the catalogue at the end of an episode.
            cache: Bytes of sequences that are kept for later episodes, or a `SourceCache` to share.
            tracker_seed: Seed of trackers that use random numbers.

        Raises:
            InputError: An argument is wrong, no parameter can be searched, a source is unreadable or lacks the
                detections, or simulated sources have seeds of two splits.
        """
        for place, got, known in (
            ("actions", actions, get_args(Actions)), ("reward", reward, get_args(Reward)),
            ("similarity", similarity, (None, *get_args(Similarity))),
        ):  # fmt: skip
            _check_choice(place, got, known)
        if not is_number(margin, 0.0, 3600.0):
            raise InputError(place="margin", got=repr(margin), expected="seconds from 0 to 3600", remedy="correct it")
        if not isinstance(cache, SourceCache):
            _check_whole("cache", cache, "bytes, 0 or more, or a SourceCache")
        _check_whole("tracker_seed", tracker_seed, "a whole number, 0 or more")
        if not isinstance(every_score, bool):
            raise InputError(place="every_score", got=repr(every_score), expected="True or False", remedy="correct it")
        self.played: AnyTracker = tracker
        self.tracker = find(tracker.tracker if isinstance(tracker, TimeLimited) else tracker)
        self.decision_every, self.tracker_seed, self.similarity = decision_every, tracker_seed, similarity
        self.actions, self.reward, self.margin, self.every_score = actions, reward, float(margin), every_score
        self.config_class = config_class(self.tracker, self.tracker.__name__)
        self.defaults = config_of(self.config_class, params)
        self.sources = sources(suite, seeds, set)
        _check_split(self.sources)
        self.mode = _detection_mode(self.tracker, self.sources, detections)
        self.space: Space = _action_parameters(self.config_class, self.mode, decision_every)
        self.presets = _presets(self.config_class, actions, presets)
        _check_presets(self.presets, self.space, self.defaults)
        self.cache = cache if isinstance(cache, SourceCache) else SourceCache(cache)
        low = np.concatenate([np.zeros(len(NAMES)), np.full(len(self.space), -1.0)]).astype(np.float32)
        self.observation_space = Box(low, np.ones_like(low), dtype=np.float32)
        self.action_space: Any = Box(-1.0, 1.0, (len(self.space),), np.float32)
        if actions == "presets":
            self.action_space = Discrete(len(self.presets))
        self.left_out: dict[Source, str] = {}  # and why: scenes whose script does not come true
        self.source, self.base = self.sources[0], self.defaults
        self._clear_episode()

    def _clear_episode(self) -> None:
        self.rollout: Rollout | None = None
        self._signals: Signals | None = None
        self._over = False
        self.config, self.score, self.scores, self.refused = self.base, 0.0, dict[str, float](), ""

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode on a source that the environment's random generator draws.

        If an error is raised, the previous episode stays the current one.

        Args:
            seed: Seeds the generator anew; None continues with its present state.
            options: "scenario" and "seed" restrict the draw to sources of this name, simulated or stored, and this
                seed; "params" are the tracker's parameters to begin with.

        Returns:
            The observation, and a dict with scenario, seed, frame (number of frames tracked), objective (of the frames
            so far, 0 while unknown; with reward="window" it is 0 before the end), scores (by key), names (the action's
            parameters), params (all values by name), and refused (the tracker's message about the last action's config,
            "" if it was accepted).

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
        _check_presets(self.presets, self.space, base)
        source, opened = self._open_source(options)
        rollout = None if self.decision_every is None else self._rollout(base, source)
        if rollout is not None:
            require_config(rollout.prepared.tracker, "decision_every")
        self.source, self.base = source, base
        self._clear_episode()
        self.rollout, self._signals = rollout, Signals(opened.sequence.fps)
        return self._observe(), self._info()

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Sets the parameters and continues tracking, to the end or for `decision_every` frames.

        Parameters that contradict each other are moved towards those that the episode began with, until they are valid.
        If the tracker refuses a config between two frames, it keeps the previous one.

        Args:
            action: One number for each parameter, (P,), clipped to [-1, 1]; or the number of a preset.

        Returns:
            The observation; the reward; True if the sequence has ended; False (an episode is never cut short); and a
            dict as `reset` returns it.

        Raises:
            InputError: Before `reset`, after the end, for an action of another shape or not finite, or from the
                tracker.
            IncomparableError: The tracks cannot be compared with the truth.
            WorkError: The tracker fails. Between two decisions this ends the episode.
        """
        if self._signals is None or self._over:
            got = "no episode" if self._signals is None else "an episode that has ended"
            raise InputError(place="step", got=got, expected="one that was begun", remedy="call reset() first")
        if self.decision_every is None:
            rollout, first = self._decided(action, self._rollout), 1
            self.rollout, self.config = rollout, cast(Config, rollout.config)
            rollout.prepared.planes.off = self.config != self.base
            terminated = self._advance(rollout, None)
        else:
            assert self.rollout is not None
            rollout, config = self.rollout, self._decided(action, lambda config: config)
            config = self.config if config == self.config else config  # trackers keep what they derive of it
            first = len(rollout.tracks) + 1
            rollout.prepared.planes.off |= config != self.base
            try:
                terminated = self._advance_with(rollout, config, len(rollout.tracks) + self.decision_every)
            except WorkError:
                self._over = True  # in the middle of a window, with a tracker in no known state
                raise
        self._over = terminated
        reward = self._rewarded(rollout, first, terminated)
        return self._observe(), reward, terminated, False, self._info()

    def episode(self) -> Episode:
        """Returns the result of the episode, once it has ended, as `tracking.episodes.episode.play` does."""
        assert self.rollout is not None, "an episode was stepped"
        return self.rollout.episode(self.scores)

    def _rewarded(self, rollout: Rollout, first: int, ended: bool) -> float:
        if ended or self.reward == "prefix":
            self.scores = rollout.scores(self.every_score and ended) if rollout.tracks else {}
        if self.reward == "prefix" or self.decision_every is None:
            before, self.score = self.score, self.scores.get("objective", 0.0)
            return self.score - before
        played = len(rollout.tracks) - first + 1
        first = max(first - round(self.margin * rollout.sequence.fps), 1)
        # HOTA is 0 where nobody is to be tracked, whatever is tracked
        right = played == 0 or _is_empty(rollout, first)
        found = 1.0 if right else rollout.window_objective(first)
        reward = (1.0 if math.isnan(found) else found) * played / rollout.length
        self.score = self.scores.get("objective", 0.0)
        return reward

    def _decided(self, action: Any, build: Any) -> Any:
        if self.actions == "presets":
            if not self.action_space.contains(action):
                expected = f"a whole number from 0 to {len(self.presets) - 1}"
                raise InputError(place="action", got=repr(action)[:80], expected=expected, remedy="correct it")
            return build(self.presets[int(action)])
        place = moved(self.space, action, self.base) if self.actions == "residual" else action
        return decode_and_build(self.space, place, self.base, build)

    def _rollout(self, config: Config, source: Source | None = None) -> Rollout:
        return Rollout(
            self.played, source or self.source, config, detections=self.mode, tracker_seed=self.tracker_seed,
            cache=self.cache, similarity=self.similarity,
        )  # fmt: skip

    def _advance(self, rollout: Rollout, upto: int | None) -> bool:
        assert self._signals is not None
        for frame, tracks in rollout.advance(upto):
            if self.decision_every is not None:  # else nothing is decided by them
                self._signals.add(frame, tracks)
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
        fitting = [s for s in self.sources if name in (None, s.name, _scenario(s)) and seed in (None, s.seed)]
        fitting = [s for s in fitting if s not in self.left_out] or fitting
        if not fitting:
            names, seeds = sorted({_scenario(s) for s in self.sources}), sorted({s.seed for s in self.sources})
            expected = f"one of {', '.join(names)}, with a seed from {seeds[0]} to {seeds[-1]}"
            raise InputError(
                place="options", got=f"scenario {name}, seed {seed}", expected=expected, remedy="correct the options"
            )
        return fitting[int(self.np_random.integers(len(fitting)))]

    def _observe(self) -> Floats:
        assert self._signals is not None
        scale = float("nan") if self.rollout is None else self.rollout.prepared.px_per_m(self.rollout.tracks)
        place = np.clip(encode(self.space, self.config), -1.0, 1.0)
        return np.concatenate([self._signals.statistics(scale), place]).astype(np.float32)

    def _info(self) -> dict[str, Any]:
        return {
            "scenario": _scenario(self.source),
            "seed": self.source.seed,
            "frame": 0 if self.rollout is None else len(self.rollout.tracks),
            "objective": self.score,
            "scores": dict(self.scores),
            "names": tuple(p.name for p in self.space),  # of the parameters that the numbers of an action set
            "params": self.config.as_dict(),
            "refused": self.refused,
        }


def _is_empty(rollout: Rollout, first: int) -> bool:
    """Returns True if there are neither people nor tracks in the frames `first` to the last one played."""
    truth, last = rollout.truth, len(rollout.tracks)
    labelled = truth.rows(last).stop > truth.rows(first).start
    return not labelled and not any(len(tracks.id) for tracks in rollout.tracks[first - 1 :])


def _scenario(source: Source) -> str:
    """Returns the name of a source without its seed, so that a stored sequence is named as a simulated one."""
    return source.name if source.simulated else source.name.removesuffix(f"-s{source.seed:05d}")


def _check_split(among: Iterable[Source]) -> None:
    seeds = sorted({s.seed for s in among if s.simulated})
    found = {split_of(range(seed, seed + 1)) for seed in seeds}
    if len(found) > 1:
        got, remedy = f"{seeds[0]} to {seeds[-1]}: {', '.join(sorted(found))}", "give seeds of one split"
        raise InputError(place="seeds", got=got, expected="seeds of one split", remedy=remedy)


def _detection_mode(tracker: type[Tracker], among: tuple[Source, ...], wanted: DetectionMode | None) -> DetectionMode:
    _check_choice("detections", wanted, (None, *modes_of(tracker.needs)))
    for source in among:
        if not source.simulated:
            wanted = choose_mode(tracker.needs, source.open(("left",)), wanted)
    if any(source.simulated for source in among):
        wanted = wanted or ("image" if streams_for(tracker, None) else "file")
    assert wanted is not None
    return wanted


def _action_parameters(kind: type[Config], mode: DetectionMode, every: int | None) -> Space:
    if every is not None and not is_whole(every, 1):
        got, expected = repr(every), "a number of frames, 1 or more, or None"
        raise InputError(place="decision_every", got=got, expected=expected, remedy="correct it")
    space = space_of(kind, mode, online=every is not None)
    if not space:
        what = "parameters to search" if every is None else "parameters that may change between frames"
        remedy = "declare some in its config (docs/guides/your-own-tracker.md)"
        raise InputError(place="tracker", got=kind.tracker, expected=f"a tracker with {what}", remedy=remedy)
    return space


def _presets(kind: type[Config], actions: Actions, presets: Iterable[Params]) -> tuple[Config, ...]:
    if isinstance(presets, str | Mapping) or not isinstance(presets, Iterable):
        got, expected = repr(presets), "a list of configs, tables or parameter files"
        raise InputError(place="presets", got=got[:80], expected=expected, remedy=f"write [{got[:40]}]")
    found = tuple(config_of(kind, one) for one in presets)
    if (actions == "presets") != bool(found):
        got = f"{len(found)} presets with actions={actions!r}"
        raise InputError(place="presets", got=got, expected='some, with actions="presets" alone', remedy="correct it")
    return found


def _check_presets(presets: Iterable[Config], space: Space, base: Config) -> None:
    """Raises InputError if a preset differs in a parameter that no action changes from what an episode begins with."""
    changeable = {p.name for p in space}
    for k, one in enumerate(presets):
        fixed = [n for n, v in one.as_dict().items() if n not in changeable and v != getattr(base, n)]
        if fixed:
            place, got = f"presets[{k}]", f"another {fixed[0]}"
            remedy = "leave it as in `params`"
            raise InputError(place=place, got=got, expected="a parameter that may change here", remedy=remedy)


def _check_whole(place: str, got: object, expected: str) -> None:
    if not is_whole(got, 0):
        raise InputError(place=place, got=repr(got), expected=expected, remedy="correct it")


def _check_choice(place: str, got: object, known: Iterable[object]) -> None:
    known = tuple(known)
    if got not in known:
        remedy = did_you_mean(str(got), map(str, known), "choose one of them") if known else "remove it"
        raise InputError(place=place, got=repr(got), expected=f"one of {', '.join(map(str, known))}", remedy=remedy)
