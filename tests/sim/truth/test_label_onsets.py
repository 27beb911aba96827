"""Four hand-made scenes, one per rule, whose onsets are worked out by hand; each is laid so that a naive rule errs.

10 frames a second: frame k is at (k - 1) / 10 s. A piece (seconds, v) walks at v from its first frame on; the velocity
of a frame is that of the step from it to the next. Everything goes the whole way, from a Motion to the events of a
Truth.
"""

import numpy as np
import pytest

from sim.truth.label import label
from tests.reference_sense import paced, walkers

FPS = 10.0


def scene(people, *intent):
    """The Motion of people who walk so; intent: (first frame, the group each one is meant to be in), …"""
    frames = len(people[0][0])
    wanted = np.zeros((frames, len(people)), np.int64)
    for first, numbers in intent:
        wanted[first - 1 :] = numbers
    pos, vel = (np.stack([p[k] for p in people], axis=1) for k in (0, 1))
    heading = np.arctan2(vel[..., 1], vel[..., 0])
    made = walkers(pos[0], vel[0], frames=frames, fps=FPS, intent=wanted)
    return made.replace(pos=pos, vel=vel, heading=heading)


def told(motion):
    """(kind, start, end, before, after, members) of every measured event."""
    return [(e.kind, e.start, e.end, e.before, e.after, e.members) for e in label(motion, None).events]


def merging():
    """Two pairs abreast at 1 m/s along x; g is the gap from y = 0.7 to the lower one of the other pair, at first 3.0 m.

    0.0-3.0 s: closing at 0.6 m/s, faster than 0.5: g = 3.0 - 0.6 t, below 1.5 from t > 2.5 on, 1.2 in the end
    3.0-4.5 s: alongside at g = 1.2: the rule holds, but for 1.5 s only
    4.5-6.5 s: away at 0.6 m/s: g = 1.2 + 0.6 (t - 4.5), 2.4 in the end
    6.5-11 s: closing at 0.38 m/s: g = 2.4 - 0.38 (t - 6.5) < 1.5 from t > 8.868 on: 8.9 s, frame 90
    11-15 s: alongside at g = 0.69, so the rule holds from frame 90 for as long as there are frames
    They are meant to be one from frame 20 on.
    """
    pieces = [(3, -0.6), (1.5, 0), (2, 0.6), (4.5, -0.38), (4, 0)]
    stay = [paced((15, (1, 0)), start=(0, y)) for y in (0, 0.7)]
    come = [paced(*((s, (1, v)) for s, v in pieces), start=(0, y)) for y in (3.7, 4.4)]
    return scene([*stay, *come], (1, (1, 1, 2, 2)), (20, (3, 3, 3, 3)))


def splitting():
    """Two pairs abreast at 1 m/s along x, in one group; g from y = 0.7 to the lower one of the other pair, 0.65 m.

    3.0-4.5 s: away at 1.0 m/s: g = 0.65 + (t - 3), above 1.5 from t > 3.85 on, velocities differing by over 0.7, but
               that ends after 0.6 s
    4.5-8.0 s: alongside at g = 2.15: further than 1.5, but not than 2.5 m, and moving alike
    8.0-15 s: away at 0.28 m/s: g = 2.15 + 0.28 (t - 8) > 2.5 from t > 9.25 on: 9.3 s, frame 94
    They are meant to be two from frame 15 on.
    """
    pieces = [(3, 0), (1.5, 1.0), (3.5, 0), (7, 0.28)]
    stay = [paced((15, (1, 0)), start=(0, y)) for y in (0, 0.7)]
    go = [paced(*((s, (1, v)) for s, v in pieces), start=(0, y)) for y in (1.35, 2.05)]
    return scene([*stay, *go], (1, (1, 1, 1, 1)), (15, (1, 1, 2, 2)))


def crossing():
    """Pair A walks right at 1.2 m/s from x = 0, pair B left at 0.8 m/s from x = 10.03, 0.2 m further up: they meet.

    Abreast (0.7 m) with footprints of 0.25 m their hulls are 10.03 - 2 t - 0.5 apart along x and overlap across it:
    within 1.0 m from t >= 4.265 on (4.3 s, frame 44) until (2 t - 10.03) - 0.5 <= 1, t <= 5.765 (5.7 s, frame 58).
    The velocities differ by 2 m/s. Pair C walks left like B, 2 m up: its hull passes 0.8 m from A's, beside it.
    """
    ways = [(0.0, 5.0, 1.2), (10.03, 5.2, -0.8), (10.03, 7.0, -0.8)]
    people = [paced((12, (v, 0)), start=(x, y + side)) for x, y, v in ways for side in (-0.35, 0.35)]
    return scene(people, (1, (1, 1, 2, 2, 3, 3)))


def queueing():
    """PersonSet come down a line towards x = 5 at 1.2 m/s, and stand 0.8 m behind one another.

    2.0 s: person 1 stands at x = 5; 3.0 s: person 2 at 5.8
    3.5-5.5 s: person 4 stands behind them, at 6.6, then leaves to the side: three in line, but for 2 s only
    8.0 s: person 3 stands at 6.6 (its velocity is 0 from frame 81 on): three in line, until 3 s are over and more
    12.0 s: person 1 is served and leaves to the side at 1 m/s; the others move up 0.8 m in 1 s, which is advancing
    15.0 s: person 2 leaves likewise: from frame 151 on less than two are in line
    """
    places = {1: 5.0, 2: 5.8, 3: 6.6, 4: 6.6}
    stand = {1: 2.0, 2: 3.0, 3: 8.0, 4: 3.5}
    leave, up = (0, 1.0), (-0.8, 0)
    after = {
        1: [(10, (0, 0)), (8, leave)],
        2: [(9, (0, 0)), (1, up), (2, (0, 0)), (5, leave)],
        3: [(4, (0, 0)), (1, up), (7, (0, 0))],
        4: [(2, (0, 0)), (14.5, leave)],
    }
    people = [paced((stand[p], (-1.2, 0)), *after[p], start=(places[p] + 1.2 * stand[p], 3)) for p in places]
    return scene(people, (1, (1, 2, 3, 4)))


# The event of each scene, and the middle of all of its people at the onset; of a crossing when the pairs are nearest,
# at 5.0 s. The rules of merge and split hold for 20 frames, 2 s. The older group, 1, keeps its id; of two equal parts
# the one with the smaller person does.
KNOWN = {
    merging: (("merge", 90, 109, (1, 2), (1,), (1, 2, 3, 4)), (8.9, 1.444)),
    splitting: (("split", 94, 113, (1,), (1, 2), (1, 2, 3, 4)), (9.3, 1.957)),
    crossing: (("cross", 44, 58, (1, 2), (1, 2), (1, 2, 3, 4)), (6.015, 5.1)),
    queueing: (("queue", 81, 150, (-1, -1, -1), (-1, -1, -1), (1, 2, 3)), (5.8, 3.0)),
}


@pytest.mark.parametrize("made", KNOWN)
def test_known_onsets(made):
    """All thresholds are met by a clear margin: a thousandth of a metre moves nothing."""
    motion, (expected, place) = made(), KNOWN[made]
    (event,) = label(motion, None).events
    assert event.pos == pytest.approx(place, abs=1e-9)
    assert event.emitted is None
    nudge = np.random.default_rng(1).uniform(-1e-3, 1e-3, motion.pos.shape)
    assert told(motion) == told(motion.replace(pos=motion.pos + nudge)) == [expected]
