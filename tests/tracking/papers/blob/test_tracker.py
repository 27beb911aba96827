"""The tracking stage of `blob` on boxes: limits, the paper's frames 357 and 367, invariants, bytes."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Camera, Context, Detections, Frame
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracker import Blob

FPS = 10.0
BOX = np.array([0.0, 0.0, 28.0, 68.0])  # a person at 40 px per m
CONTEXT = Context(fps=FPS, px_per_m=40.0, image_size=(2000, 1000))


def run(boxes, config=None, scores=None, context=CONTEXT):
    """Tracks of frames given as lists of boxes."""
    tracker = Blob(config)
    tracker.reset(context, 0)
    made = []
    for k, rows in enumerate(boxes):
        box = np.array(rows, float).reshape(-1, 4)
        score = np.ones(len(box)) if scores is None else np.array(scores[k], float)
        found = Detections(k + 1, k / FPS, "image", box[:, :2] + box[:, 2:] / 2, None, box, score)
        made.append(tracker.step(Frame(k + 1, k / FPS, detections=found), found))
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


def ids(tracks):
    return {int(i) for t in tracks for i in t.id}


def both(association):
    return BlobConfig(association=association)


@pytest.fixture(params=["nearest", "optimal"])
def config(request):
    return both(request.param)


def test_one_person_is_one_track(config):
    made = run([at((100 + 4 * k, 200)) for k in range(50)], config)
    assert len(ids(made)) == 1
    assert all(len(t.id) == 1 for t in made[5:])
    assert made[-1].pos[0] == pytest.approx([100 + 4 * 49 + 14, 234], abs=0.5)
    assert made[-1].vel[0] == pytest.approx([40.0, 0.0], abs=1.0)
    assert made[-1].box[0] == pytest.approx(at((100 + 4 * 49, 200))[0], abs=1.0)


def test_pieces_of_a_person_start_no_track(config):
    def frame(k):
        x, y = 100 + 4 * k, 200
        if 20 <= k < 30:
            return [[x, y, 28, 34], [x, y + 34, 28, 34]]
        return at((x, y))

    made = run([frame(k) for k in range(50)], config)
    assert len(ids(made)) == 1
    assert all(len(t.id) == 1 for t in made[5:])
    assert made[29].box[0] == pytest.approx([100 + 4 * 29, 200, 28, 68], abs=2.0)


def test_a_jump_is_one_new_track_and_the_old_one_dies(config):
    frames = [at((100, 200))] * 30 + [at((500, 200))] * 30
    made = run(frames, config)
    assert len(ids(made)) == 2
    first, second = sorted(ids(made))
    seen = {i: [k for k, t in enumerate(made) if i in t.id] for i in (first, second)}
    report = int(np.ceil(config.report_coast * FPS))
    assert seen[first][-1] == 29 + report
    assert 30 <= seen[second][0] <= 30 + int(np.ceil(config.report_delay * FPS))


@pytest.mark.parametrize("gap", [3, 8])
def test_a_short_absence_keeps_the_id(config, gap):
    made = run([at((100 + 4 * k, 200)) if not 25 <= k < 25 + gap else [] for k in range(50)], config)
    assert len(ids(made)) == 1


def test_a_long_absence_ends_the_track_and_ids_are_not_reused(config):
    frames = [at((100, 200))] * 20 + [[]] * 40 + [at((100, 200))] * 20
    made = run(frames, config)
    assert len(ids(made)) == 2
    assert not set(made[19].id) & set(made[-1].id)


def test_crossing_people_keep_their_ids():
    frames = [at((100 + 12 * k, 200), (700 - 12 * k, 230)) for k in range(50)]
    made = run(frames, both("optimal"))
    assert len(ids(made)) == 2
    assert made[5].pos[np.argsort(made[5].id), 0][0] < made[5].pos[np.argsort(made[5].id), 0][1]
    assert made[-1].pos[np.argsort(made[-1].id), 0][0] > made[-1].pos[np.argsort(made[-1].id), 0][1]


def test_hidden_person_coasts_longer_than_one_who_is_merely_missed():
    config = BlobConfig(association="optimal", coast_time=0.5, merged_time=3.0)

    def frame(k, front):
        walker = at((300 + 4 * k, 200))
        blocker = [[380, 180, 90, 160]] if front else []
        hidden = 20 <= k < 32
        return blocker + ([] if hidden else walker)

    behind = run([frame(k, True) for k in range(60)], config)
    open_field = run([frame(k, False) for k in range(60)], config)
    assert len(ids(behind)) == 2
    assert len(ids(open_field)) == 2
    assert sum(len(t.id) for t in behind[45:]) == 2 * 15


def test_a_box_over_two_unseen_people_is_neither_born_nor_their_death():
    config = BlobConfig(association="optimal", coast_time=0.5, merged_time=3.0)

    def frame(k):
        if 20 <= k < 35:
            return [[100 + 4 * k, 200, 28 + 45, 68]]
        return at((100 + 4 * k, 200), (145 + 4 * k, 200))

    made = run([frame(k) for k in range(60)], config)
    assert len(ids(made)) == 2


def test_weak_detections_continue_but_do_not_start(config):
    frames = [at((100 + 4 * k, 200)) for k in range(40)]
    weak = run(frames, config, [[config.score_continue]] * 40)
    assert not ids(weak)
    fading = run(frames, config, [[1.0 if k < 15 else config.score_continue] for k in range(40)])
    assert len(ids(fading)) == 1
    assert all(len(t.id) == 1 for t in fading[15:])


@pytest.mark.parametrize(
    "config",
    [BlobConfig(), BlobConfig(association="nearest", gate=0.99), BlobConfig(confirm_ratio=1.05, tentative_time=0.1)],
)
@pytest.mark.parametrize("fps", [2.5, 7.0, 10.0, 25.0])
def test_whoever_is_always_seen_is_confirmed(config, fps):
    tracker = Blob(config)
    tracker.reset(Context(fps=fps, px_per_m=40.0), 0)
    for k in range(int(5 * fps)):
        box = np.array(at((100, 200)))
        tracker.step(Frame(k + 1, k / fps), Detections(k + 1, k / fps, "image", box[:, :2], None, box, np.ones(1)))
    assert tracker.people.id.tolist() == [1]
    assert tracker.people.confirmed.all()


@pytest.mark.parametrize("seed", range(6))
def test_moving_the_scene_moves_the_answer(config, seed):
    boxes, shift = crowd(seed), np.array([333.0, -77.0, 0, 0])
    open_context = Context(fps=FPS, px_per_m=40.0)
    first, second = (
        run(boxes, config, context=open_context),
        run([list(np.array(b) + shift) if len(b) else b for b in boxes], config, context=open_context),
    )
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


def pinhole(tilt_deg=25.0, height=4.0):
    tilt = np.radians(tilt_deg)
    forward, right = np.array([0.0, np.cos(tilt), -np.sin(tilt)]), np.array([1.0, 0, 0])
    rotation = np.stack([right, np.cross(forward, right), forward])
    return Camera("pinhole", (640, 480), (500.0, 500.0), (320.0, 240.0), np.array([0.0, 0, height]), rotation)


def above():
    up = np.diag([1.0, -1.0, -1.0])
    return Camera("top", (640, 480), (1.0, 1.0), (320.0, 240.0), np.array([0.0, 0, 10]), up, px_per_m=40.0)


@pytest.mark.parametrize("camera", [pinhole(), above()], ids=["pinhole", "top"])
def test_reports_on_the_ground_where_the_camera_is_known(camera):
    from sim.scene.camera import project, px_per_m_at_centre

    context = Context(fps=FPS, px_per_m=px_per_m_at_centre(camera), camera=camera, image_size=camera.image)
    middle = np.array([0.0, 9.0]) if camera.kind == "pinhole" else np.zeros(2)
    path = middle + np.array([[-2 + 0.1 * k, 0.03 * k] for k in range(40)])
    boxes = []
    for x, y in path:
        (foot, head), _ = project(camera, np.array([[x, y, 0.0], [x, y, 1.7]]))
        if camera.kind == "top":
            boxes.append([[*(foot - 9), 18, 18]])
        else:
            boxes.append([[foot[0] - 15, head[1], 30, foot[1] - head[1]]])
    last = run(boxes, context=context)[-1]
    assert last.plane == "ground"
    assert last.pos[0] == pytest.approx(path[-1], abs=0.1)
    assert last.vel[0] == pytest.approx([1.0, 0.3], abs=0.1)
    assert (np.linalg.eigvalsh(last.cov[0]) > 0).all()


@pytest.mark.parametrize("scale", [float("nan"), 0.0])
def test_boxes_without_a_scale_are_refused(scale):
    with pytest.raises(InputError, match=r"context\.px_per_m"):
        run([at((100, 100))], context=Context(fps=FPS, px_per_m=scale))
