"""The clocks of a simulated world, and the frames of a camera between their ticks.

Physics and script have clocks of their own; the frame rate is a property of the camera alone. A frame is the state at
its time, on the straight line between two steps of the physics. Groups and events are measured at the ticks of the
script; an onset belongs to the frame nearest to it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES
from sim.types import Array, Bools, Ints, Motion

PHYSICS_RATE = 50.0  # Hz
SCRIPT_RATE = 10.0  # Hz: people come and go, orders and stops are looked at, fluctuations change
STEPS = 5  # of the physics per tick of the script
EXACT = 1e-6  # of a step: a frame as near to a step is on it


@dataclass(frozen=True)
class FrameTimes:
    """The position of a camera's T frames on the clocks of script and physics; frame f, from 0, is at f / fps s."""

    fps: float
    tick: Ints  # (T,) last tick of the script at or before the frame, from 0
    step: Ints  # (T,) physics steps from there to the last one at or before the frame
    share: Array  # (T,) share of the next step that has passed, 0 to 1

    @classmethod
    def of(cls, length: int, fps: float) -> FrameTimes:
        """Returns the times of `length` frames at fps frames/s."""
        at = np.arange(length) / fps * PHYSICS_RATE
        whole = np.floor(at + EXACT)
        share = np.maximum(at - whole, 0.0)
        steps = whole.astype(np.int64)
        return cls(fps, steps // STEPS, steps % STEPS, np.where(share < EXACT, 0.0, share))

    def frame_of(self, tick: int) -> int:
        """Returns the number, from 1 to T, of the frame nearest in time to a tick (from 0).

        Of two equally near frames it is the later one.
        """
        return min(int(np.floor(tick * self.fps / SCRIPT_RATE + 0.5)) + 1, len(self.tick))

    def within(self, tick: int) -> slice:
        """Returns the slice of the frames (from 0) that lie at or after a tick (from 0) and before the next tick."""
        return slice(*np.searchsorted(self.tick, (tick, tick + 1)))

    def states(self, tick: int, steps: Array) -> Array:
        """Returns the states (K, P, D) in the K frames of `within(tick)`, linear between two physics steps.

        steps (STEPS + 1, P, D): the states at this tick and after each physics step up to the next tick.
        """
        frames = self.within(tick)
        k, share = self.step[frames], self.share[frames, None, None]
        low, high = steps[k], steps[k + 1]
        return np.where(share == 0.0, low, (1.0 - share) * low + share * high)

    def between_ticks(self, values: Array, present: Bools) -> Array:
        """Returns the values (T, P, D) at the frames, linear between the values (C, P, D) at the ticks.

        present (C, P): where a person is absent at the next tick, the value of the last tick is kept.
        """
        # The value of the last tick stays where a person is absent at the next one.
        k = np.minimum(self.tick, len(values) - 1)
        after = np.minimum(k + 1, len(values) - 1)
        share = ((self.step + self.share) / STEPS)[:, None, None]
        between = values[k] + share * (values[after] - values[k])
        return np.asarray(np.where(present[after][..., None], between, values[k]))


@dataclass(frozen=True)
class FrameTicks:
    """For each of T frames the tick whose groups the frame shows; frames and ticks count from 0.

    tick (T,): that tick, ascending. It is the last tick whose nearest frame is this frame or an earlier one. But it is
    always before the next tick, after the time of the frame, at which people come or go.
    """

    tick: Ints

    @classmethod
    def of(cls, length: int, fps: float, rate: float, present: Bools) -> FrameTicks:
        """Returns the FrameTicks of `length` frames at fps frames/s.

        rate: ticks per s. present (C, P): who is present at each of the C ticks.
        """
        frame, ticks = np.arange(length), np.arange(len(present))
        if fps == rate:
            return cls(np.minimum(frame, len(ticks) - 1))
        nearest = np.floor(ticks * (fps / rate) + 0.5)
        shown = np.searchsorted(nearest, frame, side="right") - 1
        before = np.minimum(np.floor(frame * (rate / fps) + EXACT).astype(np.int64), len(ticks) - 1)
        turns = np.append(np.flatnonzero((present[1:] != present[:-1]).any(axis=1)) + 1, len(ticks))
        return cls(np.minimum(shown, turns[np.searchsorted(turns, before, side="right")] - 1))

    def first(self, tick: int) -> int:
        """Returns the first frame that shows this tick or a later one; T if there is none."""
        return int(np.searchsorted(self.tick, tick))

    def last(self, tick: int) -> int:
        """Returns the last frame that shows this tick or an earlier one; -1 if there is none."""
        return int(np.searchsorted(self.tick, tick, side="right")) - 1


def check_stride(stride: object, fps: float) -> None:
    """Raises InputError unless `stride` is an int of at least 1 that leaves at least 0.01 frames/s.

    fps: frames/s before every `stride`-th frame is taken.
    """
    most = int(fps / FRAME_RATES[0])
    if not isinstance(stride, int) or not 1 <= stride <= most:
        expected = f"a whole number from 1 to {most} at {fps:g} frames/s"
        raise InputError(place="--stride", got=stride, expected=expected, remedy="correct it")


def every_nth(motion: Motion, n: int) -> Motion:
    """Returns the motion in the frames 1, 1 + n, 1 + 2 n, … only, numbered from 1 again, at fps / n frames/s.

    The states from which groups and events are measured stay the same. If n is 1, `motion` itself is returned.
    """
    if n == 1:
        return motion
    kept = {name: getattr(motion, name)[::n] for name in ("pos", "vel", "heading", "present", "intent")}
    times = FrameTimes.of(len(kept["present"]), motion.fps / n)

    def fired(time: float | None) -> int | None:
        return None if time is None else times.frame_of(round(time * SCRIPT_RATE))

    orders = tuple(replace(order, fired=fired(order.time)) for order in motion.orders)
    looks = None if motion.looks is None else motion.looks.every(n)
    return motion.replace(fps=times.fps, orders=orders, measured=motion.states(), looks=looks, **kept)
