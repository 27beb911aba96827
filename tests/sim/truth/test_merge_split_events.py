import numpy as np

from tests.plots import measured, partition
from tests.reference_groups import labels
from tests.reference_sense import paced

FPS = 10.0


def crowd(*people):
    pos, vel = (np.stack([p[k] for p in people], axis=1) for k in (0, 1))
    return pos, vel, np.ones(pos.shape[:2], bool)


def meant(*steps, frames):
    """Intent (T, P) from (first frame, numbers)."""
    out = np.zeros((frames, len(steps[0][1])), np.int64)
    for first, numbers in steps:
        out[first - 1 :] = numbers
    return out


def summary(events):
    return [(e.kind, e.start, e.end, e.before, e.after, e.members) for e in events]


def merging(speed, near):
    """Two pairs side by side at 1 m/s; the second drifts towards the first at `speed` until `near` m are left."""
    seconds = round((6 - near) / speed, 1)
    first = [paced((20, (1, 0)), start=(0, y)) for y in (-0.7, 0)]
    second = [paced((seconds, (1, -speed)), (20 - seconds, (1, 0)), start=(0, y)) for y in (6, 6.7)]
    return crowd(*first, *second)


def test_merge_no_earlier_than_intent_and_not_without():
    m = measured(*merging(0.4, 0.8), meant((1, (1, 1, 2, 2)), (150, (3, 3, 3, 3)), frames=200), FPS)
    assert [e.start for e in m.events] == [150]
    m = measured(*merging(0.4, 0.8), meant((1, (1, 1, 2, 2)), frames=200), FPS)
    assert m.events == ()
    assert m.near.a.tolist() == [2]
    assert m.near.b.tolist() == [3]
    assert (m.near.start.tolist(), m.near.end.tolist()) == ([114], [200])


def test_a_stretch_cut_off_by_the_end_does_not_count():
    pos, vel, there = merging(0.4, 0.8)
    want = meant((1, (1, 1, 2, 2)), (50, (3, 3, 3, 3)), frames=200)
    assert len(measured(pos[:133], vel[:133], there[:133], want[:133], FPS).events) == 1
    assert len(measured(pos[:132], vel[:132], there[:132], want[:132], FPS).events) == 0


def test_who_enters_together_counts_from_the_first_frame():
    pos, vel, there = crowd(*(paced((10, (1, 0)), start=(0, y)) for y in (0, 4, 4.7, 5.4)))
    there[:20, 1:3] = False
    there[:40, 3] = False
    there[80:, 1:] = False
    m = measured(pos, vel, there, np.where(there, [1, 2, 2, 2], -1), FPS)
    assert summary(m.events) == [("enter", 21, 21, (), (1,), (2, 3)), ("leave", 80, 80, (1,), (), (2, 3, 4))]
    assert (m.group[20:40, 1:3] == 1).all()
    assert (m.group[40:80, 1:] == 1).all()
    assert (m.group[~there] == -1).all()


def scene(seed, frames=60, people=7, fps=4.0):
    """PersonSet wander about in a small place, come, go and change their minds."""
    r = np.random.default_rng(seed)
    vel = np.cumsum(r.normal(0, 0.35, (frames, people, 2)), 0) * 0.5
    vel -= np.linspace(0, 1, frames)[:, None, None] * vel[-1]
    pos = np.abs((r.uniform(0, 4, (people, 2)) + np.cumsum(vel, 0) / fps) % 8 - 4)
    there = np.ones((frames, people), bool)
    for p in range(people):
        there[: r.integers(0, frames // 3) * (r.random() < 0.5), p] = False
        there[frames - r.integers(0, frames // 3) * (r.random() < 0.4) :, p] = False
        there[30 : 30 + 3 * (r.random() < 0.2), p] = False
    intent, now = np.zeros((frames, people), np.int64), r.integers(0, 3, people)
    for t in range(frames):
        if r.random() < 0.06:
            now[r.integers(people)] = r.integers(0, 3)
        intent[t] = now
    nowhere = ~there[..., None]
    return np.where(nowhere, np.nan, pos), np.where(nowhere, np.nan, vel * 0.4), there, np.where(there, intent, -1), fps


def test_labels_are_those_of_the_rules_read_frame_by_frame():
    kinds = set()
    for seed in range(60):
        made = scene(seed)
        m = measured(*made)
        assert partition(m.group) == labels(*made), seed
        kinds |= {e.kind for e in m.events}
    assert kinds == {"merge", "split", "form", "dissolve", "enter", "leave"}


def test_events_tell_every_change_of_labels():
    """Between two frames without an event, nobody who stays changes group."""
    for seed in range(30):
        pos, vel, there, intent, fps = scene(seed)
        m = measured(pos, vel, there, intent, fps)
        starts = {e.start for e in m.events if e.kind != "leave"} | {e.start + 1 for e in m.events if e.kind == "leave"}
        for t in range(1, len(pos)):
            stay = there[t] & there[t - 1] & (m.group[t] != m.group[t - 1])
            assert not stay.any() or t + 1 in starts


def test_near_lists_strangers_only_and_whole_stretches():
    for seed in range(30):
        pos, vel, there, intent, fps = scene(seed)
        m = measured(pos, vel, there, intent, fps)
        expected = []
        for a in range(there.shape[1]):
            for b in range(a + 1, there.shape[1]):
                same = (m.group[:, a] >= 0) & (m.group[:, a] == m.group[:, b])
                gap, differ = (np.hypot(*(x[:, a] - x[:, b]).T) for x in (pos, vel))
                ok = (gap < 1.5) & (differ < 0.5) & (intent[:, a] != intent[:, b]) & ~same
                edges = np.flatnonzero(np.diff(np.concatenate([[0], ok.astype(int), [0]])))
                expected += [(s + 1, e, a + 1, b + 1) for s, e in edges.reshape(-1, 2) if e - s >= 8]
        got = zip(m.near.start, m.near.end, m.near.a, m.near.b, strict=True)
        assert sorted(tuple(map(int, row)) for row in got) == sorted(expected), seed
