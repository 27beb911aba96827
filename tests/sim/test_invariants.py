"""What does not matter to groups and events: who has which number, where the world lies and how it is turned, what
comes later, how often one looks, and strangers far away."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.truth.crossing_events import crossings
from sim.truth.motion_rows import MotionRows
from sim.truth.queue_detection import queues
from tests.plots import DURATION, crosses, look, measured, merges, partition, scenes, splits

FPS = 10.0
SETTLED = 8.0  # s: what ended so long ago is known, whatever follows


def measure(scene):
    """Labels (T, P) and events as (kind, start, end, members, how many groups and people alone before, and after)."""
    found = measured(scene.pos, scene.vel, scene.present, scene.intent, scene.fps)
    motion = MotionRows.of_table(scene.pos, scene.vel, scene.present, found.group)
    return found.group, [*found.events, *crossings(motion, scene.fps), *queues(motion, scene.fps)]


def rows(events, name=lambda p: p):
    """Events without their ids, and without what a mirror turns: ids and the first of equals hang on numbers."""
    shape = [(tuple(sorted(g < 0 for g in e.before)), tuple(sorted(g < 0 for g in e.after))) for e in events]
    return sorted(
        (e.kind, e.start, e.end, tuple(sorted(name(m) for m in e.members)), *s)
        for e, s in zip(events, shape, strict=True)
    )


@settings(max_examples=10, deadline=None)
@given(scenes())
def test_each_plot_has_its_event_at_its_time(plots):
    """The other tests would be empty without it."""
    _, events = measure(look(plots, FPS))
    assert sorted(e.kind for e in events) == sorted(p.kind for p in plots)
    known = sorted((p.kind, p.onset) for p in plots if np.isfinite(p.onset))
    got = sorted((e.kind, (e.start - 1) / FPS) for e in events if e.kind != "cross")
    assert all(0 <= t - onset <= 1 / FPS + 1e-9 for (_, t), (_, onset) in zip(got, known, strict=True))


@settings(max_examples=10, deadline=None)
@given(scenes(), st.randoms(use_true_random=False))
def test_numbers_of_people_do_not_matter(plots, random):
    scene = look(plots, FPS)
    order = list(range(scene.pos.shape[1]))
    random.shuffle(order)
    known, place = np.unique(scene.intent, return_inverse=True)
    intent = np.array(random.sample(range(1000), len(known)))[place].reshape(scene.intent.shape)
    mixed = scene.but(
        pos=scene.pos[:, order], vel=scene.vel[:, order], present=scene.present[:, order], intent=intent[:, order]
    )
    (group, events), (again, told) = measure(scene), measure(mixed)
    assert partition(group[:, order]) == partition(again)
    assert rows(events) == rows(told, lambda p: order[p - 1] + 1)


# Angle between the corners of a footprint, a 16-gon. Turned by another angle its hull is up to 5 mm smaller, so that
# an encounter (hulls within 1.0 m) may begin or end one frame earlier or later.
CORNER_DEG = 22.5
ANGLES = st.one_of(st.floats(0, 360), st.integers(0, 15).map(lambda corners: CORNER_DEG * corners))


@settings(max_examples=10, deadline=None)
@given(scenes(), st.floats(-1000, 1000), st.floats(-1000, 1000), ANGLES, st.booleans())
def test_place_and_turn_of_the_world_do_not_matter(plots, x, y, degrees, mirror):
    scene = look(plots, FPS)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, s], [-s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])
    elsewhere = scene.but(pos=scene.pos @ turn + [x, y], vel=scene.vel @ turn)
    (group, events), (again, turned) = measure(scene), measure(elsewhere)
    assert np.array_equal(group, again)
    exact = abs(degrees / CORNER_DEG - round(degrees / CORNER_DEG)) < 1e-9
    slack = 0 if exact else 1
    by_members = [sorted(rows(e), key=lambda row: (row[0], row[3], row[1])) for e in (events, turned)]
    for a, b in zip(*by_members, strict=True):
        assert (a[0], *a[3:]) == (b[0], *b[3:])
        assert np.abs(np.subtract(a[1:3], b[1:3])).max() <= (slack if a[0] == "cross" else 0)
    for a, b in zip(*(sorted(e, key=lambda e: (e.kind, e.members)) for e in (events, turned)), strict=True):
        np.testing.assert_allclose(np.array(a.pos) @ turn + [x, y], b.pos, atol=1e-6)


@settings(max_examples=10, deadline=None)
@given(scenes(), st.floats(0.4, 0.95))
def test_what_comes_later_does_not_change_what_has_been(plots, share):
    scene = look(plots, FPS)
    frames = int(share * DURATION * FPS)
    short = scene.but(**{k: getattr(scene, k)[:frames] for k in ("pos", "vel", "present", "intent")})
    (group, events), (again, told) = measure(scene), measure(short)
    known = frames - round(2 * FPS)
    assert np.array_equal(group[:known], again[:known])
    settled = frames - round(SETTLED * FPS)
    assert [r for r in rows(events) if r[2] <= settled] == [r for r in rows(told) if r[2] <= settled]
    assert {r[:2] for r in rows(told)} <= {r[:2] for r in rows(events)}, "nothing is told that then was not"


@settings(max_examples=10, deadline=None)
@given(scenes(), st.sampled_from([5.0, 12.5, 20.0, 25.0, 30.0]))
def test_the_frame_rate_does_not_matter(plots, fps):
    """Onsets to one frame of the slower rate (lines are looked at 10 times a second at most)."""
    (_, events), (_, told) = measure(look(plots, FPS)), measure(look(plots, fps))
    sides = [sorted((e.kind, e.members, (e.start - 1) / f) for e in some) for some, f in ((events, FPS), (told, fps))]
    assert [side[:2] for side in sides[0]] == [side[:2] for side in sides[1]]
    assert all(abs(a[2] - b[2]) <= 1 / min(FPS, fps) + 0.1 / 2 for a, b in zip(*sides, strict=True))


@settings(max_examples=10, deadline=None)
@given(scenes(), scenes())
def test_strangers_far_away_do_not_matter(plots, others):
    few, many = look(plots, FPS), look([*plots, *others], FPS)
    (group, events), (again, told) = measure(few), measure(many)
    people = group.shape[1]
    assert partition(again[:, :people]) == partition(group)
    assert [r for r in rows(told) if r[3][0] <= people] == rows(events)


@settings(max_examples=10, deadline=None)
@given(st.one_of(merges(), splits(), crosses()))
def test_one_who_has_gone_is_nobody(plot):
    """Rows of people who are never there change nothing, whatever numbers stand in them."""
    scene = look([plot], FPS)
    extra = np.full((len(scene.pos), 2, 2), np.nan)
    more = scene.but(
        pos=np.concatenate([extra, scene.pos], axis=1),
        vel=np.concatenate([extra, scene.vel], axis=1),
        present=np.concatenate([np.zeros(extra.shape[:2], bool), scene.present], axis=1),
        intent=np.concatenate([np.full(extra.shape[:2], -1), scene.intent], axis=1),
    )
    (group, events), (again, told) = measure(scene), measure(more)
    assert np.array_equal(group, again[:, 2:])
    assert rows(events, lambda p: p + 2) == rows(told)
