"""`group-pda` as a user drives it, on points: crossings, invariances, hidden groups, misses, lost frames, bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Array, Context, Detections, Frame, Tracks
from tests.painted import ids
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.tracker import GroupPda

FPS = 10.0
GROUND = Context(FPS, float("nan"))
# (M, 2) of one frame; None is a lost one.
Points = Array | None


def track(
    frames: Iterable[Points],
    config: GroupPdaConfig | None = None,
    plane: str = "ground",
    context: Context = GROUND,
    watch: Callable[[GroupPda, Tracks], None] | None = None,
    tracker: GroupPda | None = None,
) -> list[Tracks]:
    """Answers to the points of each frame."""
    tracker = tracker or GroupPda(config)
    tracker.reset(context, 0)
    made = []
    for k, points in enumerate(frames):
        found = None
        if points is not None:
            found = Detections(k + 1, k / context.fps, plane, points, score=np.ones(len(points)))  # type: ignore[arg-type]
        made.append(tracker.step(Frame(k + 1, k / context.fps, detections=found), found))
        if watch is not None:
            watch(tracker, made[-1])
    return made


def block(across: int, deep: int, at: tuple[float, float] = (0.0, 0.0)) -> Array:
    """(across * deep, 2) people in rows about a place, 0.6 m apart."""
    x, y = np.arange(across) - (across - 1) / 2, np.arange(deep) - (deep - 1) / 2
    return np.asarray(np.stack(np.meshgrid(x, y), -1).reshape(-1, 2) * 0.6 + at)


def noisy(groups: Iterable[Array], r: np.random.Generator) -> Array:
    """All groups' points with measurement noise."""
    points = np.concatenate([np.zeros((0, 2)), *groups])
    return points + r.normal(0, 0.03, points.shape)


def crossing(
    seed: int, speed: float = 2.4, ranks: tuple[int, int] = (2, 2), turn: float = np.pi, frames: int = 70
) -> list[Array]:
    """Two groups, two abreast, that walk through each other in the middle of the time, their ways this angle apart.
    speed: the difference of their velocities, m/s."""
    r = np.random.default_rng(seed)
    a, b = (block(2, n) + r.normal(0, 0.1, (2 * n, 2)) for n in ranks)
    one, other = np.array([1.0, 0.0]), np.array([np.cos(turn), np.sin(turn)])
    s = (np.arange(frames) - frames / 2) / FPS * speed / np.hypot(*(one - other))
    return [noisy([a + w * one, b + w * other], r) for w in s]


def events(made: list[Tracks], *kinds: str) -> list[tuple[str, int, tuple[int, ...], tuple[int, ...]]]:
    """kind, start, before, after of the events of these kinds."""
    return [(e.kind, e.start, e.before, e.after) for t in made for e in t.events if e.kind in kinds]


def changes(made: list[Tracks]) -> list[tuple[str, int, tuple[int, ...], tuple[int, ...]]]:
    return events(made, "merge", "split")


def sizes(tracks: Tracks) -> Array:
    return tracks.groups.size


def busy(seed: int, late: Array | None = None, frames: int = 110) -> list[Array]:
    """Groups that pass each other, join and part, born one after the other; late: one more, at rest from frame 20."""
    r, made = np.random.default_rng(seed), []
    for k in range(frames):
        s = k / FPS
        walkers = [block(2, 2, (1.2 * s, 0)), block(2, 3, (12 - 1.2 * s, 0.3))]
        beside = [block(2, 2, (s, 20)), block(2, 1, (s, 21.3 + max(3 - 0.8 * s, 0)))]
        row = block(4, 1, (0, 40 + s))
        row[2:, 0] += 0.8 * max(s - 4, 0)
        here = [g for n, g in enumerate([*walkers, *beside, row]) if k > 2 * n]
        points = noisy(here, r)
        made.append(points if late is None or k < 20 else np.concatenate([points, late]))
    return made


def same(a: list[Tracks], b: list[Tracks], matrix: Array | None = None, shift: Array | None = None) -> None:
    """b says of the moved scene what a says: ids, events, states, in places moved by matrix and shift."""
    A, d = np.eye(2) if matrix is None else matrix, np.zeros(2) if shift is None else shift
    B = np.kron(np.eye(2), A)
    for x, y in zip(a, b, strict=True):
        assert x.id.tolist() == y.id.tolist()
        np.testing.assert_allclose(y.pos, x.pos @ A.T + d, atol=1e-6)
        np.testing.assert_allclose(y.vel, x.vel @ A.T, atol=1e-6)
        np.testing.assert_allclose(y.cov, B @ x.cov @ B.T, atol=1e-6)
        np.testing.assert_allclose(sizes(y), sizes(x), atol=1e-6)
        assert [(e.kind, e.start, e.emitted, e.before, e.after) for e in x.events] == [
            (e.kind, e.start, e.emitted, e.before, e.after) for e in y.events
        ]
        for e, f in zip(x.events, y.events, strict=True):
            np.testing.assert_allclose(f.pos, A @ np.array(e.pos) + d, atol=1e-6)


@pytest.mark.parametrize("ranks", [(2, 2), (3, 2)])
@pytest.mark.parametrize("turn", [np.pi, np.pi / 2])
def test_groups_that_walk_through_each_other_keep_ids_and_sizes(ranks: tuple[int, int], turn: float) -> None:
    for seed in range(8):
        made = track(crossing(seed, 2.4, ranks, turn))
        before, after = made[15], made[-1]
        assert before.id.tolist() == after.id.tolist() == [1, 2]
        assert not changes(made)
        assert after.vel == pytest.approx(before.vel, abs=0.5)
        assert sizes(after) == pytest.approx(sizes(before), rel=0.1)


TURN = np.array([[0.8, -0.6], [0.6, 0.8]])


@pytest.mark.parametrize("seed", range(3))
def test_a_turned_and_shifted_scene_is_the_same(seed: int) -> None:
    frames, shift = busy(seed), np.array([-35.0, 12.0])
    made = track(frames)
    assert {e[0] for e in changes(made)} == {"merge", "split"}
    same(made, track([p @ TURN.T + shift for p in frames]), TURN, shift)


@pytest.mark.parametrize("seed", range(3))
def test_in_the_image_it_is_the_same_at_any_scale(seed: int) -> None:
    frames, shift = busy(seed), np.array([500.0, 20.0])
    moved = [40 * p @ TURN.T + shift for p in frames]
    same(track(frames), track(moved, plane="image", context=Context(FPS, 40.0)), 40 * TURN, shift)


def missed(seed: int, speed: float, share: float = 0.8, frames: int = 120) -> tuple[list[Array], Array]:
    """A group of four, each seen with this probability but for the first second; where its middle is (T, 2)."""
    r = np.random.default_rng(seed)
    middle = np.array([[speed * k / FPS, 0.0] for k in range(frames)])
    seen = (r.random((frames, 4)) < share) | (np.arange(frames) < FPS)[:, None]
    return [noisy([block(2, 2) + m], r)[s] for m, s in zip(middle, seen, strict=True)], middle


@pytest.mark.parametrize("speed", [0.0, 1.2])
def test_misses_neither_part_a_group_nor_shrink_nor_move_it(speed: float) -> None:
    error, bare = [], []
    for seed in range(4):
        frames, middle = missed(seed, speed)
        made = track(frames)
        assert ids(made) == {1}
        assert not changes(made)
        assert all(abs(sizes(t)[0] - 4) <= 0.5 for t in made[10:])
        error.append([np.hypot(*(t.pos[0] - m)) for t, m in zip(made[10:], middle[10:], strict=True)])
        said = track(frames, GroupPdaConfig(carry_time=0.0))
        both = zip(said[10:], middle[10:], strict=True)
        bare.append([np.hypot(*(t.pos - m).T).min(initial=1.0) for t, m in both])
    assert np.mean(error) < 0.05
    assert np.mean(bare) > 1.5 * np.mean(error)


def holds(hull: Array, point: Array) -> bool:
    """Whether a counter-clockwise polygon holds a point."""
    edge, d = np.roll(hull, -1, 0) - hull, point - hull
    return bool((edge[:, 0] * d[:, 1] - edge[:, 1] * d[:, 0] >= 0).all())


def test_a_hidden_member_is_inside_the_hull_until_a_group_would_be_lost() -> None:
    r, hidden = np.random.default_rng(0), int(1.5 * FPS)
    frames = [noisy([block(2, 2)], r)[: 4 if k < 40 else 3] for k in range(40 + 2 * hidden)]
    inside = [holds(t.groups.hull[0], block(2, 2)[3]) for t in track(frames)[40:]]
    assert inside == [k < hidden for k in range(2 * hidden)]


@pytest.mark.parametrize("angle", [0.0, 0.8, 1.6])
@pytest.mark.parametrize(("ranks", "gap"), [(2, 0.45), (2, 1.0), (3, 1.0)])
def test_a_false_alarm_beside_a_group_is_no_member(angle: float, ranks: int, gap: float) -> None:
    """In one frame, so far from the circle that holds the group; 0.45 m is in its region."""
    r, at = np.random.default_rng(0), 60
    away = (0.3 * (ranks - 1) * np.sqrt(2) + gap) * np.array([np.cos(angle), np.sin(angle)])
    middle = np.array([[0.05 * k, 0.0] for k in range(100)])
    frames = [noisy([block(ranks, ranks) + m], r) for m in middle]
    struck = [np.vstack([p, middle[at] + away]) if k == at else p for k, p in enumerate(frames)]
    plain, made = track(frames), track(struck)
    assert ids(made) == {1}
    assert not changes(made)
    for k in range(at + 2, len(frames)):
        own, other = made[k].groups, plain[k].groups
        assert not holds(own.hull[0], middle[k] + away)  # nor does he walk along
        assert own.hull[0] - own.pos[0] == pytest.approx(other.hull[0] - other.pos[0], abs=0.1)
        assert abs(own.size[0] - other.size[0]) <= 1 / ranks**2


def test_frames_that_tell_nothing() -> None:
    """Lost ones at first and on the way, and ones without points: the ids stay, and the groups go on."""
    frames = crossing(0)
    some: list[Points] = [None, None, np.zeros((0, 2)), *frames]
    some[20:23] = [None, None, None]
    some[60:62] = [np.zeros((0, 2)), None]
    made = track(some)
    assert [len(t.id) for t in made[:3]] == [0, 0, 0]
    assert ids(made) == {1, 2}
    for k in (20, 21, 22, 60, 61):
        assert made[k].id.tolist() == [1, 2]
        assert made[k].pos == pytest.approx(made[k - 1].pos + made[k].vel / FPS)
    assert not changes(made)


@pytest.mark.parametrize("plane", ["ground", "image"])
def test_a_lost_first_frame_does_not_decide_on_the_plane(plane: str) -> None:
    context, unit = Context(FPS, 40.0), 40.0 if plane == "image" else 1.0
    frames = [unit * p for p in crossing(0)]
    plain, late = track(frames, plane=plane, context=context), track([None, *frames], plane=plane, context=context)
    for x, y in zip(plain, late[1:], strict=True):
        assert y.plane == plane
        np.testing.assert_allclose(y.pos, x.pos, atol=1e-6)
        np.testing.assert_allclose(y.cov, x.cov, atol=1e-6)


@pytest.mark.parametrize("first", [[], [None]])
def test_the_image_needs_a_scale(first: list[Points]) -> None:
    with pytest.raises(InputError) as told:
        track([*first, block(2, 2)], plane="image")
    assert told.value.place == "context.px_per_m"
