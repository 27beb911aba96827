"""What does not matter to the groupings: ids, place, turn and unit of the world, what comes later, strangers far
away, and, within what it waits for, how often one looks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.types import Tracks
from tests.plots import DURATION, look, scenes
from tracking.grouping import grouped_tracks
from tracking.grouping.grouping_choice import grouping_of

FPS = 10.0
both = pytest.mark.parametrize("grouping", ["belief", "rule"])


def derive(tracks, fps, scale=1.0, *, grouping):
    return grouped_tracks.derive(tracks, fps, scale, grouping_of(grouping))


def tracks(scene, ids=None, scale=1.0):
    """The people of a scene as tracks of persons 1, 2, … or `ids`, without groups; scale px/m: in the image."""
    people = scene.pos.shape[1]
    ids = np.arange(1, people + 1) if ids is None else np.array(ids)
    plane, nobody, cov, score = "ground", np.full(people, -1), np.zeros((people, 4, 4)), np.ones(people)
    plane = plane if scale == 1 else "image"
    return [
        Tracks(t + 1, t / scene.fps, plane, "person", ids, nobody, pos * scale, vel * scale, cov, None, score)
        for t, (pos, vel) in enumerate(zip(scene.pos, scene.vel, strict=True))
    ]


def events(made, ids=None):
    """(told in frame, kind, start, members) of all; members by their place in `ids`."""
    place = {p: k + 1 for k, p in enumerate(ids)} if ids is not None else None
    return sorted(
        (t.index, e.kind, e.start, tuple(sorted(place[m] if place else m for m in e.members)))
        for t in made
        for e in t.events
    )


def partition(made):
    """By frame the groups, as sets of columns."""
    return [{frozenset(np.flatnonzero(t.group == g).tolist()) for g in set(t.group.tolist()) - {-1}} for t in made]


@both
@settings(max_examples=8, deadline=None)
@given(scenes(), st.data())
def test_ids_do_not_matter(grouping, plots, data):
    scene = beside(look(plots, FPS))
    ids = data.draw(st.permutations(range(3, 3 + 2 * scene.pos.shape[1]))).copy()[: scene.pos.shape[1]]
    base, renamed = derive(tracks(scene), FPS, grouping=grouping), derive(tracks(scene, ids), FPS, grouping=grouping)
    assert partition(renamed) == partition(base)
    assert events(renamed, ids) == events(base)


def beside(scene):
    """A scene a little beside the plots, whose round numbers lie on thresholds and are ties, where order decides."""
    return scene.but(pos=scene.pos + np.random.default_rng(0).normal(0, 1e-5, scene.pos.shape))


# Degrees from one corner of a footprint to the next: after such a turn hulls are the same, after others nearly.
CORNER = 22.5


@both
@settings(max_examples=8, deadline=None)
@given(
    scenes(), st.floats(-500, 500), st.one_of(st.floats(0, 360), st.integers(0, 15).map(lambda k: k * CORNER)),
    st.booleans(), st.sampled_from([1.0, 18.8, 250.0]),
)  # fmt: skip
def test_place_turn_and_unit_do_not_matter(grouping, plots, x, degrees, mirror, scale):
    scene = beside(look(plots, FPS))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, s], [-s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])
    moved = scene.but(pos=scene.pos @ turn + [x, -x], vel=scene.vel @ turn)
    base, again = (
        derive(tracks(scene), FPS, grouping=grouping),
        derive(tracks(moved, scale=scale), FPS, scale, grouping=grouping),
    )
    assert partition(base) == partition(again)
    if degrees % CORNER == 0:
        assert events(base) == events(again)
    else:  # a crossing begins when hulls are near each other
        sides = [[e for e in events(made) if e[1] != "cross"] for made in (base, again)]
        assert sides[0] == sides[1]


@both
@settings(max_examples=8, deadline=None)
@given(scenes(), st.floats(0.4, 0.95))
def test_what_comes_later_changes_no_label(grouping, plots, share):
    scene = look(plots, FPS)
    frames = int(share * DURATION * FPS)
    short = scene.but(**{k: getattr(scene, k)[:frames] for k in ("pos", "vel", "present", "intent")})
    base, again = derive(tracks(scene), FPS, grouping=grouping), derive(tracks(short), FPS, grouping=grouping)
    assert partition(base)[:frames] == partition(again)
    changes = [[e for e in events(made) if e[1] in ("merge", "split") and e[0] <= frames] for made in (base, again)]
    assert changes[0] == changes[1]


@settings(max_examples=8, deadline=None)
@given(scenes(), scenes())
def test_strangers_far_away_do_not_matter(plots, others):
    """To the rule; the belief learns from them how much positions err, and how many people are mates."""
    few, many = (derive(tracks(look(some, FPS)), FPS, grouping="rule") for some in (plots, [*plots, *others]))
    people = len(few[0].id)
    assert [{g for g in groups if min(g) < people} for groups in partition(many)] == partition(few)
    assert [e for e in events(many) if e[3][0] <= people] == events(few)


@settings(max_examples=8, deadline=None)
@given(scenes(), st.sampled_from([5.0, 20.0, 25.0]))
def test_the_frame_rate_does_not_matter(plots, fps):
    """To two frames of the slower rate: 80 % of 10 frames are 8, of 50 they are 40."""
    sides = [
        sorted((kind, members, (start - 1) / f, (k - 1) / f) for k, kind, start, members in events(made))
        for f, made in ((f, derive(tracks(look(plots, f)), f, grouping="rule")) for f in (FPS, fps))
    ]
    assert [side[:2] for side in sides[0]] == [side[:2] for side in sides[1]]
    for a, b in zip(*sides, strict=True):
        assert abs(a[2] - b[2]) <= 2 / min(FPS, fps)
        assert abs(a[3] - b[3]) <= 2 / min(FPS, fps)
