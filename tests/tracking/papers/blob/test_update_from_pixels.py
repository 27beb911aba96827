"""`blob` from pixels: pieces, posts, jumps, shared blobs, shadows, lost and absurd frames, feedback, bytes."""

from __future__ import annotations

import numpy as np
import pytest

from tests import painted
from tests.painted import TALL, box, ids, overlap, track
from tracking.filters import kalman
from tracking.papers.blob import person_look_kernels
from tracking.papers.blob.config import BlobConfig


def walk(x, foot, step, frames):
    """One person who walks to the right."""
    return [(x + step * k, foot, TALL) for k in range(frames)]


def mine(tracks, person, least=0.5):
    """The id of the box that is this person's, or 0."""
    found = [(overlap(b, box(person)), int(i)) for b, i in zip(tracks.box, tracks.id, strict=True)]
    best = max(found, default=(0.0, 0))
    return best[1] if best[0] >= least else 0


def test_one_person_is_one_track_and_its_box_is_right():
    way = walk(60, 180, 4, 30)
    made = track([[p] for p in way])
    assert [len(t.id) for t in made[2:]] == [1] * 28
    assert len(ids(made)) == 1
    assert np.mean([overlap(t.box[0], box(p)) for t, p in zip(made[5:], way[5:], strict=True)]) > 0.75


def test_a_person_in_two_pieces_for_ten_frames_stays_one_track():
    """The paper's frame 367: a bar of the ground's own colour hides the waist."""
    way, frames, r = walk(60, 180, 4, 40), [], np.random.default_rng(5)
    for k, p in enumerate(way):
        image = painted.picture([p], r).copy()
        if 15 <= k < 25:
            waist = slice(int(p[1] - 0.58 * TALL), int(p[1] - 0.4 * TALL))
            image[waist] = painted.picture([], r)[waist]
        frames.append(image)
    known = []
    made = track(frames, watch=lambda tracker, _: known.append(len(tracker.people.id)))
    assert max(known) == 1
    assert len(ids(made)) == 1
    assert all(overlap(t.box[0], box(p)) > 0.5 for t, p in zip(made[5:], way[5:], strict=True))


def test_a_post_does_not_cut_a_person_in_two():
    way = walk(100, 180, 3, 40)
    made = track([[p] for p in way], post=160.0)
    assert len(ids(made)) == 1
    assert all(len(t.id) == 1 for t in made[3:])


def test_a_jump_starts_one_track_at_once_and_ends_the_other():
    """The paper's frame 357: the person is suddenly far outside the gate."""
    way = [*walk(60, 180, 3, 20), *walk(250, 150, 1, 30)]
    known = []
    made = track([[p] for p in way], watch=lambda tracker, _: known.append(tracker.people.id.tolist()))
    assert known[19] == [1]
    assert known[20] == [1, 2]
    assert ids(made) == {1, 2}
    last = max(t.index for t in made if 1 in t.id)
    assert 20 <= last <= 20 + 1.5 * painted.FPS


def test_two_who_cross_in_one_blob_keep_who_they_are():
    left, right = walk(60, 180, 5, 40), [(260 - 5 * k, 174, TALL) for k in range(40)]
    made = track(list(zip(left, right, strict=True)))
    start, end = made[8], made[-1]
    assert mine(start, left[8])
    assert mine(start, right[8])
    assert mine(end, left[-1]) == mine(start, left[8])
    assert mine(end, right[-1]) == mine(start, right[8])
    assert len(ids(made)) == 2
    unsplit = track(list(zip(left, right, strict=True)), BlobConfig(split=False))
    shared = [abs(a[0] - b[0]) < 15 for a, b in zip(left, right, strict=True)]

    def both(run):
        return sum(
            bool(mine(t, a)) + bool(mine(t, b)) for t, a, b, s in zip(run, left, right, shared, strict=True) if s
        )

    assert both(made) >= both(unsplit)


@pytest.mark.parametrize("by_looks", [True, False])
def test_two_who_meet_in_one_blob_and_turn_back_keep_their_colours(monkeypatch, by_looks):
    """By their motion alone they would cross."""
    if not by_looks:
        monkeypatch.setattr(person_look_kernels, "learn", lambda *_: None)
    way = [*range(60, 161, 3), *range(159, 60, -3)]
    pair = [[(x, 180, TALL), (320 - x, 176, TALL)] for x in way]
    made = track(pair)
    start, end = ([mine(made[k], person) for person in pair[k]] for k in (8, -1))
    assert sorted(start) == [1, 2]
    assert end == (start if by_looks else start[::-1])


@pytest.mark.parametrize(("dark", "moved"), [(0.4, False), (1.0, True)])
def test_shadows_move_the_centroid_only_where_they_are_foreground(dark, moved):
    """With `dark` at 1 whatever is darker than the ground is dark foreground: there is no class of shadows."""
    way, seen, split = walk(60, 180, 3, 25), [], BlobConfig(dark=dark, split=False)
    track([[p] for p in way], split, shadow=0.45, watch=lambda tracker, _: seen.append(tracker.people.bank[:, :1]))
    bank = seen[-1][:, 0]
    off = abs(bank[kalman.PLACE, 0] - way[-1][0]) / (TALL / 1.7)
    assert (off > 3 * np.sqrt(bank[kalman.VAR, 0])) == moved


def test_a_track_that_lies_stands_up_where_templates_measure_it():
    """Two in one blob, one of whom was taken for somebody lying."""
    pair = [[(80 + 4 * k, 180, TALL), (98 + 4 * k, 181, TALL)] for k in range(30)]

    def fell(tracker, tracks):
        if tracks.index == 12:
            tracker.people.angle[0, 0] = 0.0

    made = track(pair, watch=fell)
    assert made[12].box[0, 2] > made[12].box[0, 3]
    for t, (a, b) in zip(made[18:], pair[18:], strict=True):
        assert mine(t, a) == mine(made[11], pair[11][0])
        assert mine(t, b) == mine(made[11], pair[11][1])


def test_windows_follow_the_image_while_nobody_was_seen():
    scales = []
    for k in (1, 2):
        sample = np.stack([painted.picture([], np.random.default_rng(0))] * 12).repeat(k, 1).repeat(k, 2)
        tracker = painted.Blob()
        tracker.reset(painted.Context(painted.FPS, float("nan"), background=sample), 0)
        scales.append(tracker.updater.foreground.scale)
    assert scales[1] == pytest.approx(2 * scales[0])


def test_a_lost_frame_only_predicts():
    way, state = walk(60, 180, 4, 20), []
    frames = [[p] for p in way]
    frames[12] = None
    made = track(frames, watch=lambda tracker, _: state.append(tracker.people.bank.copy()))
    assert np.allclose(state[12][kalman.PLACE], state[11][kalman.PLACE] + 0.1 * state[11][kalman.RATE])
    assert np.array_equal(state[12][kalman.RATE], state[11][kalman.RATE])
    assert len(ids(made)) == 1
    assert len(made[12].id) == 1


def test_a_light_that_is_switched_starts_no_flood():
    r = np.random.default_rng(1)
    frames = [painted.picture([p], r) for p in walk(60, 180, 4, 16)]
    for k in range(8, 16):
        frames[k] = np.clip(frames[k].astype(float) * [0.55, 1.3, 1.6], 0, 255).astype(np.uint8)
        frames[k].flags.writeable = False
    known = []
    track(frames, watch=lambda tracker, _: known.append(tracker.people.next_id))
    assert known[-1] <= 4


def test_a_confirmed_person_who_stands_is_not_learned_as_background(monkeypatch):
    stands = [[(120.0, 180.0, TALL)]] * 60
    monkeypatch.setattr("tracking.detect.background.FOREGROUND_SLOWER", 1.0)
    made = track(stands, BlobConfig(background_time=2.0))
    assert mine(made[-1], stands[0][0])


def test_a_moved_scene_moves_the_answer():
    """All pictures shifted to the right by 24 px: the same tracks, 24 px to the right."""
    people = [[(60 + 4 * k, 180, TALL), (200 - 3 * k, 175, TALL)] for k in range(25)]

    def run(shift):
        r, wide = np.random.default_rng(3), painted.WIDE
        shown = [painted.picture([p], r) for p in painted.spread()]
        frames = [painted.picture(p, r) for p in people]
        blank = painted.ground()[:, :1].repeat(shift, 1).astype(np.uint8)
        moved = [np.concatenate([blank, f[:, : wide - shift]], 1) for f in shown + frames]
        tracker = painted.Blob()
        scene = np.stack(moved[: len(shown)])
        context = painted.Context(painted.FPS, TALL / 1.7, image_size=(wide, painted.HIGH), background=scene)
        tracker.reset(context, 0)
        return [tracker.step(painted.Frame(k + 1, k / 10, image=f), None) for k, f in enumerate(moved[len(shown) :])]

    for a, b in zip(run(0), run(24), strict=True):
        assert a.id.tolist() == b.id.tolist()
        if len(a.id):
            assert np.abs(b.box - a.box - [24, 0, 0, 0]).max() < 1.5


def test_the_pictures_tell_the_size_that_nobody_told():
    """An unseen track is carried on, and one that left dies, whether the image's size was given or not."""
    way = (
        [[(60.0 + 6 * k, 200.0, TALL)] for k in range(20)]
        + [None] * 4
        + [[(204.0 + 6 * k, 200.0, TALL)] for k in range(6)]
    )
    told, untold = (painted.track(way, size=size) for size in ((painted.WIDE, painted.HIGH), None))
    assert [len(t.id) for t in untold[20:24]] == [1] * 4
    for a, b in zip(told, untold, strict=True):
        assert a.id.tolist() == b.id.tolist()
        np.testing.assert_array_equal(a.box, b.box)
