"""The tracking stage of `blob` on boxes: limits, the paper's frames 357 and 367, invariants, bytes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Context, Detections, Frame, Scene, Stairs
from tests.painted import ids
from tests.reference_sense import above, pinhole
from tracking.filters import existence
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracker import Blob

FPS = 10.0
BOX = np.array([0.0, 0.0, 28.0, 68.0])  # a person at 40 px per m
CONTEXT = Context(fps=FPS, px_per_m=40.0, image_size=(2000, 1000))


def run(boxes, config=None, scores=None, context=CONTEXT, tracker=None, before=lambda k: None):
    """Tracks of frames given as lists of boxes; before: called with the number of each frame, from 0."""
    tracker = tracker or Blob(config)
    tracker.reset(context, 0)
    made = []
    for k, rows in enumerate(boxes):
        box = np.array(rows, float).reshape(-1, 4)
        score = np.ones(len(box)) if scores is None else np.array(scores[k], float)
        found = Detections(k + 1, k / context.fps, "image", box[:, :2] + box[:, 2:] / 2, None, box, score)
        before(k)
        made.append(tracker.step(Frame(k + 1, k / context.fps, detections=found), found))
    return made


def at(*centres):
    """Boxes of people with these centres."""
    return [BOX + np.array([x, y, 0, 0]) for x, y in centres]


def crowd(seed, frames=60, people=8):
    """Boxes of people who walk, some missed, with false alarms."""
    r = np.random.default_rng(seed)
    p, v = r.uniform(200, 800, (people, 2)), r.normal(0, 5, (people, 2))
    out = []
    for k in range(frames):
        seen = r.random(people) < 0.85
        boxes = BOX + np.c_[p + v * k, np.zeros((people, 2))] + r.normal(0, 1.5, (people, 4))
        false = [[*r.uniform(0, 1000, 2), 28, 68] for _ in range(r.poisson(0.7))]
        out.append([*boxes[seen], *false])
    return out


@pytest.fixture(params=["rho", "existence"])
def config(request):
    return BlobConfig(management=request.param)


def test_without_an_image_size_the_view_is_what_boxes_have_covered(config):
    tracker = Blob(config)
    run([at((100, 200), (300, 260)), at((50, 400))], tracker=tracker, context=replace(CONTEXT, image_size=None))
    assert tracker.people.view.tolist() == [[50, 200], [328, 468]]


def test_one_person_is_one_track(config):
    made = run([at((100 + 4 * k, 200)) for k in range(50)], config)
    assert len(ids(made)) == 1
    assert all(len(t.id) == 1 for t in made[5:])
    assert made[-1].pos[0] == pytest.approx([100 + 4 * 49 + 14, 234], abs=0.5)
    assert made[-1].vel[0] == pytest.approx([40.0, 0.0], abs=1.0)
    assert made[-1].box[0] == pytest.approx(at((100 + 4 * 49, 200))[0], abs=1.0)


def test_who_was_measured_is_reported(config):
    made = run([at((100 + 4 * k, 200)) if k not in (20, 21) else [] for k in range(30)], config)
    assert [t.index - 1 for t in made[5:] if not t.seen.all()] == [20, 21]
    assert all(len(t.seen) == len(t.id) == 1 for t in made[5:])


def test_a_jump_is_one_new_track_and_the_old_one_dies(config):
    frames = [at((100, 200))] * 30 + [at((500, 200))] * 30
    made = run(frames, config)
    assert len(ids(made)) == 2
    first, second = sorted(ids(made))
    seen = {i: [k for k, t in enumerate(made) if i in t.id] for i in (first, second)}
    assert 29 <= seen[first][-1] < 29 + 2 * FPS
    assert 30 <= seen[second][0] <= 36


@pytest.mark.parametrize("gap", [3, 8])
def test_a_short_absence_keeps_the_id(config, gap):
    made = run([at((100 + 4 * k, 200)) if not 25 <= k < 25 + gap else [] for k in range(50)], config)
    assert len(ids(made)) == 1


def test_a_long_absence_ends_the_track_and_ids_are_not_reused(config):
    frames = [at((100, 200))] * 20 + [[]] * 40 + [at((100, 200))] * 20
    made = run(frames, config)
    assert len(ids(made)) == 2
    assert not set(made[19].id) & set(made[-1].id)


def test_a_frame_that_nobody_observed_is_no_evidence():
    tracker = Blob()
    run([at((100, 200))] * 20, tracker=tracker)
    before = tracker.people.existence()
    for k in range(20, 40):
        tracker.step(Frame(k + 1, k / FPS), None)
    assert tracker.people.existence() == pytest.approx(before * np.exp(-2 / existence.LIFETIME))


def test_crossing_people_keep_their_ids():
    frames = [at((100 + 12 * k, 200), (700 - 12 * k, 230)) for k in range(50)]
    made = run(frames, BlobConfig())
    assert len(ids(made)) == 2
    assert made[5].pos[np.argsort(made[5].id), 0][0] < made[5].pos[np.argsort(made[5].id), 0][1]
    assert made[-1].pos[np.argsort(made[-1].id), 0][0] > made[-1].pos[np.argsort(made[-1].id), 0][1]


def test_a_hidden_person_lasts_longer_than_one_who_is_merely_missed():
    def existence(front):
        blocker, tracker = [[540, 150, 140, 320]] if front else [], Blob()
        run([blocker + ([] if k >= 20 else at((500 + 4 * k, 200))) for k in range(40)], tracker=tracker)
        walker = tracker.people.bank[0, :, 2] < 100
        return tracker.people.existence()[walker].sum()

    assert existence(True) > 2 * existence(False)


@pytest.mark.parametrize("growth", [-3.0, 3.0])
def test_a_missed_person_keeps_its_size(growth):
    high = 68 + growth * (np.arange(12) - 11)
    made = run([[[200, 300 - h, 28, h]] for h in high] + 6 * [[]])
    last, missed = (made[k].box[0, 3] for k in (11, 17))
    assert abs(missed - last) < 5


def test_a_second_box_of_a_person_is_nobody():
    double = [[104 + 4 * k, 198, 30, 72] for k in range(40)]
    made = run([[*at((100 + 4 * k, 200)), *([double[k]] if k % 4 == 0 else [])] for k in range(40)])
    assert len(ids(made)) == 1


@pytest.mark.parametrize("detected", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("fps", [2.5, 5.0, 25.0])
def test_people_are_tracked_at_each_rate_of_frames_and_detections(fps, detected):
    r, n, frames = np.random.default_rng(1), int(20 * fps), []
    for k in range(n):
        rows = at((100 + 40 * k / fps, 200), (1500 - 40 * k / fps, 600))
        frames.append(np.array([b for b in rows if r.random() < detected]).reshape(-1, 4) + r.normal(0, 1))
    made = run(frames, context=Context(fps=fps, px_per_m=40.0, image_size=(2000, 1000)))
    count, found = [len(t.id) for t in made], ids(made)
    assert np.mean(count[n // 10 :]) > (1.0 if detected < 0.7 and fps < 5 else 1.5)
    assert max(count) <= 3
    assert len(found) <= (8 if detected < 1 else 2)


@pytest.mark.parametrize(("low", "high"), [(0.05, 0.9), (-1.0, 110.0)])
def test_scores_are_learned_from_what_becomes_of_their_boxes(low, high):
    """Scores of people and of false boxes, in whatever unit."""
    r, frames, scores = np.random.default_rng(2), [], []
    for k in range(60):
        false = [[*r.uniform(0, (1900, 900)), 28, 68] for _ in range(4)]
        frames.append([*at((100 + 4 * k, 200), (900, 100 + 3 * k)), *false])
        scores.append([high, high, *[low] * 4])
    tracker = Blob()
    assert len(run(frames, scores=scores, tracker=tracker)[-1].id) == 2
    ratio = tracker.updater.scores.ratios(np.array([low, high]))
    assert ratio[0] < 0.5 < 2 < ratio[1]


@pytest.mark.parametrize(
    "config",
    [BlobConfig(), BlobConfig(management="rho", gate=0.99), BlobConfig(management="rho", confirm_ratio=1.05)],
)
@pytest.mark.parametrize("fps", [2.5, 7.0, 10.0, 25.0])
def test_whoever_is_always_seen_is_confirmed(config, fps):
    tracker = Blob(config)
    run([at((100, 200))] * int(5 * fps), context=Context(fps=fps, px_per_m=40.0), tracker=tracker)
    assert tracker.people.id.tolist() == [1]
    assert tracker.people.confirmed.all()


@pytest.mark.parametrize("seed", range(6))
def test_moving_the_scene_moves_the_answer(config, seed):
    boxes, shift = crowd(seed), np.array([333.0, -77.0, 0, 0])
    moved, context = [[box + shift for box in b] for b in boxes], Context(fps=FPS, px_per_m=40.0)
    first, second = run(boxes, config, context=context), run(moved, config, context=context)
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a.id, b.id)
        assert np.allclose(a.pos + shift[:2], b.pos, rtol=0, atol=1e-6)
        assert np.allclose(a.cov, b.cov, rtol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_covariances_are_sound_and_ids_unique(config, seed):
    for t in run(crowd(seed), config):
        assert len(set(t.id.tolist())) == len(t.id)
        for cov in t.cov:
            assert np.array_equal(cov, cov.T)
            assert (np.linalg.eigvalsh(cov) > 0).all()


@pytest.mark.slow
def test_innovations_are_white_and_of_unit_size_on_the_model_itself():
    r = np.random.default_rng(3)
    config = BlobConfig(gate=0.999999)
    tracker = Blob(config)
    tracker.reset(Context(fps=FPS, px_per_m=40.0), 0)
    dynamics = config.dynamics(FPS)
    place, rate = np.array([500.0, 500, 68, 28]), np.zeros(4)
    found = []
    for k in range(3000):
        push = r.normal(0, dynamics.sigma * 40)
        push[2:] = 0
        place = place + rate / FPS + push / FPS**2 / 2
        rate = rate + push / FPS
        rate[:2] *= 0.999
        z = place + r.normal(0, np.sqrt(dynamics.noise) * 40) * [1, 1, 0, 0]
        box = np.array([[z[0] - z[3] / 2, z[1] - z[2] / 2, z[3], z[2]]])
        before = tracker.people.bank[:, :1, :2].copy() if len(tracker.people.id) else None
        detections = Detections(k + 1, k / FPS, "image", box[:, :2], None, box, np.ones(1))
        tracker.step(Frame(k + 1, k / FPS), detections)
        if before is not None and k > 50:
            predicted = before[0, 0] + before[1, 0] / FPS
            found.append((z[:2] - predicted) / (40 * np.sqrt(dynamics.asymptote[:2])))
    assert tracker.people.next_id == 2
    found = np.array(found)
    assert np.mean(found**2) == pytest.approx(1.0, abs=0.08)
    for lag in range(1, 6):
        assert abs(np.mean(found[lag:] * found[:-lag])) < 0.06


@pytest.mark.parametrize("high", [0.0, 1.0])
@pytest.mark.parametrize("camera", [pinhole(25.0, at=(0.0, 0.0, 4.0)), above()], ids=["pinhole", "top"])
def test_reports_on_the_ground_where_the_camera_is_known(camera, high):
    from sim.scene.camera import project, px_per_m_at_centre

    flight = Stairs(np.array([-9.0, 9.0]), np.array([-6.0, 9.0]), 20.0, high, 4, landing=30.0)
    scene = Scene(np.array([30.0, 30.0]), stairs=(flight,) if high else ())
    context = Context(FPS, px_per_m_at_centre(camera), camera, scene, camera.image)
    middle = np.array([0.0, 9.0] if camera.kind == "pinhole" else [8.0, 5.0])
    path = middle + np.array([[-2 + 0.1 * k, 0.03 * k] for k in range(40)])
    boxes = []
    for x, y in path:
        (foot, head), _ = project(camera, np.array([[x, y, high], [x, y, high + 1.7]]))
        if camera.kind == "top":
            boxes.append([[*(foot - 9), 18, 18]])
        else:
            boxes.append([[foot[0] - 15, head[1], 30, foot[1] - head[1]]])
    last = run(boxes, context=context)[-1]
    assert last.plane == "ground"
    assert last.pos[0] == pytest.approx(path[-1], abs=0.1)
    assert last.vel[0] == pytest.approx([1.0, 0.3], abs=0.1)
    assert (np.linalg.eigvalsh(last.cov[0]) > 0).all()


def test_places_on_the_ground_are_steadier_than_feet_of_boxes():
    from sim.scene.standing import standing_points
    from tracking.papers.blob import box_geometry
    from tracking.papers.blob.tracked_people import seen_boxes

    camera, r = pinhole(4.0, at=(0.0, 0.0, 1.2)), np.random.default_rng(30_000)
    path = np.array([[-2 + 0.1 * k, 12 + 0.03 * k, 0, 0, 1.8] for k in range(60)])
    box = np.insert(seen_boxes(camera, path, np.zeros(len(path))), 3, 20, axis=1)
    box[:, 1:3] += box[:, 2:3] * r.normal(0, [0.05, 0.09], (60, 2))
    frames = run(box_geometry.ltwh_from_centred(box), context=Context(FPS, 30.0, camera, None, camera.image))
    pos, below = np.array([(t.pos[0], standing_points(t.box, camera)[0]) for t in frames])[20:, :, 1].T
    assert np.std(np.diff(pos, 2)) < 0.4 * np.std(np.diff(below, 2))


def test_whose_feet_come_into_sight_just_below_the_horizon_is_not_lost_far_away():
    camera, box = pinhole(0.0, at=(0.0, 0.0, 1.2)), np.tile([300.0, 219.0, 28.0, 71.0], (80, 1))  # 12 m away
    box[:, 3] *= np.minimum(0.3 + np.arange(80) / 40, 1)
    frames = run(box[:, None], context=Context(FPS, 30.0, camera, None, camera.image))
    assert max(np.hypot(*t.pos[0]) for t in frames if len(t.pos)) < 60
    assert frames[-1].pos[0, 1] == pytest.approx(12, abs=1)


@pytest.mark.parametrize("scale", [float("nan"), 0.0])
def test_boxes_without_a_scale_are_refused(scale):
    with pytest.raises(InputError, match=r"context\.px_per_m"):
        run([at((100, 100))], context=Context(fps=FPS, px_per_m=scale))
