"""Scenes as functions of time, with an event each whose onset is known: for what must not change the events.

A plot is n people over DURATION seconds: their ways are straight between knots, so that the same scene can be looked at
with any frame rate. Parameters are drawn so that no threshold of a rule is met by a hair.
"""

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st

from sim.truth.merge_split_events import groups_and_events
from sim.truth.motion_rows import MotionRows

DURATION = 24.0  # s
APART = 60.0  # m between the plots of a scene
WIDTH = 0.7  # m between two who walk abreast
MOVE = 0.8  # m/s at which people move up in a queue


@dataclass(frozen=True)
class Plot:
    """knots: for each person times (K,) and places (K, 2); intent: (from second, numbers of the people), …"""

    kind: str
    onset: float  # s
    knots: tuple[tuple[np.ndarray, np.ndarray], ...]
    intent: tuple[tuple[float, tuple[int, ...]], ...]


@dataclass(frozen=True)
class Scene:
    """What rules are given: pos, vel (T, P, 2), present (T, P), intent (T, P), fps."""

    pos: np.ndarray
    vel: np.ndarray
    present: np.ndarray
    intent: np.ndarray
    fps: float

    def but(self, **changed):
        return Scene(**{**self.__dict__, **changed})


def measured(pos, vel, present, intent, fps):
    """Groups and events, with the groups as a table (T, P)."""
    rows, group = MotionRows.of_table(pos, vel, present, intent), np.full(present.shape, -1)
    found = groups_and_events(rows, fps)
    group[rows.frame, rows.column] = found.group
    return replace(found, group=group)


def partition(group):
    return [{frozenset(np.flatnonzero(row == g).tolist()) for g in set(row.tolist()) - {-1}} for row in group]


def look(plots, fps, duration=DURATION):
    """The plots side by side, as seen `fps` times a second."""
    t = np.arange(round(duration * fps)) / fps
    pos, vel, intent = [], [], []
    for number, plot in enumerate(plots):
        wanted = np.zeros((len(t), len(plot.knots)), np.int64)
        for since, numbers in plot.intent:
            wanted[t >= since - 1e-9] = numbers
        intent.append(wanted + 100 * number)
        for times, places in plot.knots:
            way = np.stack([np.interp(t, times, places[:, k]) for k in (0, 1)], axis=1)
            pos.append(way + np.array([0, APART * number]))
            piece = np.clip(np.searchsorted(times, t + 1e-9, side="right") - 1, 0, len(times) - 2)
            vel.append((np.diff(places, axis=0) / np.diff(times)[:, None])[piece])
    pos, vel = np.stack(pos, axis=1), np.stack(vel, axis=1)
    return Scene(pos, vel, np.ones(pos.shape[:2], bool), np.concatenate(intent, axis=1), fps)


def way(start, *pieces):
    """Knots of one who walks at v for so many seconds, (seconds, v), …; for ever in the end."""
    seconds, v = np.array([p[0] for p in pieces]), np.array([p[1] for p in pieces], float)
    seconds[-1] = 100.0
    places = np.array(start, float) + np.concatenate([[[0, 0]], np.cumsum(v * seconds[:, None], axis=0)])
    return np.concatenate([[0], np.cumsum(seconds)]), places


def number(low, high):
    """A number that is no threshold: fifty values between low and high, all odd."""
    return st.integers(0, 49).map(lambda k: low + (high - low) * (k + 0.317) / 50)


@st.composite
def merges(draw):
    """Two pairs walk abreast; the second closes in on the first."""
    gap, left, closing, speed = (
        draw(number(2.5, 3.5)), draw(number(0.5, 1.1)), draw(number(0.25, 0.42)), draw(number(0.5, 1.4)),
    )  # fmt: skip
    stay = [way((0, y), (1, (speed, 0))) for y in (0, WIDTH)]
    come = [way((0, WIDTH + gap + y), ((gap - left) / closing, (speed, -closing)), (1, (speed, 0))) for y in (0, WIDTH)]
    intent = (0, (1, 1, 2, 2)), (draw(number(0.3, 1.5)), (3, 3, 3, 3))
    return Plot("merge", (gap - 1.5) / closing, (*stay, *come), intent)


@st.composite
def splits(draw):
    """Two pairs walk as one; the second drifts away."""
    begin, parting, speed = draw(number(1, 4)), draw(number(0.25, 0.6)), draw(number(0.5, 1.4))
    stay = [way((0, y), (1, (speed, 0))) for y in (0, WIDTH)]
    go = [way((0, 2 * WIDTH + y), (begin, (speed, 0)), (1, (speed, parting))) for y in (0, WIDTH)]
    intent = (0, (1, 1, 1, 1)), (draw(number(0.3, 1.5)), (1, 1, 2, 2))
    return Plot("split", begin + (2.5 - WIDTH) / parting, (*stay, *go), intent)


@st.composite
def crosses(draw):
    """Two pairs come from 8 to 12 m away and walk through each other."""
    angle, when = np.radians(draw(number(70, 290))), draw(number(8, 11))
    people = []
    for speed, turn, off in (
        (draw(number(0.9, 1.3)), 0.0, 0.0),
        (draw(number(0.9, 1.3)), angle, draw(number(-0.2, 0.2))),
    ):
        v = speed * np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-v[1], v[0]]) / speed
        people += [way(-v * when + (off + side) * across, (1, v)) for side in (-WIDTH / 2, WIDTH / 2)]
    return Plot("cross", np.nan, tuple(people), ((0, (1, 1, 2, 2)),))


@st.composite
def queues(draw):
    """Three to five strangers line up, one after the other; some are served. Those behind move up, and then stand for
    longer than a frame of any rate: else two moves are one in some rates, and that one lasts as long as a queue may.
    """
    n, spacing, speed = draw(st.integers(3, 5)), draw(number(0.6, 1.2)), draw(number(0.8, 1.4))
    stand = np.cumsum([draw(number(1, 3)) for _ in range(n)])
    served, pause = draw(st.integers(0, n - 2)), spacing / MOVE + draw(number(0.25, 1.5))
    leave = stand[-1] + 4 + pause * np.arange(n)
    people = []
    for k in range(n):
        pieces = [(stand[k], (-speed, 0))]
        now = stand[k]
        for turn in range(min(served, k)):
            pieces += [(leave[turn] - now, (0, 0)), (spacing / MOVE, (-MOVE, 0))]
            now = leave[turn] + spacing / MOVE
        pieces += [(leave[k] - now, (0, 0)), (1, (0, 1.2))] if k < served else [(1, (0, 0))]
        people.append(way((spacing * k + speed * stand[k], 0), *pieces))
    return Plot("queue", float(stand[2]), tuple(people), ((0, tuple(range(n))),))


def scenes():
    """One to three plots, side by side."""
    return st.lists(st.one_of(merges(), splits(), crosses(), queues()), min_size=1, max_size=3)
