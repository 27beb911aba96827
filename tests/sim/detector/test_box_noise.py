import numpy as np
import pytest
from scipy.stats import norm, t

from scenarios.schema.sensor import BoxNoise, Memory
from sim.detector.box_noise import box_errors, heavy_tailed, perturb_boxes, seen_shift
from sim.detector.draws import correlated_normals
from sim.detector.visible_ground import furthest_row
from sim.scene.camera import foot_points, project
from tests.reference_sense import above, pinhole

NOISE = BoxNoise(across=(0.02, 0.05), foot=(-0.03, 0.04), top=(0.01, 0.06), width=(0.2, 0.1), occluded=2.0)


def some(count: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    r = np.random.default_rng(0)
    box = np.column_stack([r.uniform(0, 600, count), r.uniform(0, 300, count), r.uniform(20, 60, count)])
    return np.column_stack([box, r.uniform(50, 200, count)]), r.standard_normal((count, 4))


@pytest.mark.parametrize(("visible", "factor"), [(1.0, 1.0), (0.25, 2.5)])
def test_errors_have_the_means_and_sds_asked_for_and_grow_with_occlusion(visible: float, factor: float) -> None:
    box, n = some()
    e = box_errors(perturb_boxes(box, np.full(len(box), visible), NOISE, n), box)
    assert e.mean(axis=0) == pytest.approx([0.02, -0.03, 0.01, 0.2], abs=0.003 * factor)
    assert e.std(axis=0) == pytest.approx(factor * np.array([0.05, 0.04, 0.06, 0.1]), rel=0.03)


@pytest.mark.parametrize("kurtosis", [0.5, 3.0, 30.0])
def test_heavy_tails_are_those_of_students_t(kurtosis: float) -> None:
    n, freedom = np.linspace(-5.0, 5.0, 301), 4 + 6 / kurtosis
    expected = t.isf(norm.sf(np.abs(n)), freedom) * np.sign(n) * np.sqrt((freedom - 2) / freedom)
    assert heavy_tailed(n, kurtosis) == pytest.approx(expected, rel=1e-3)
    assert np.isfinite(heavy_tailed(np.array([-40.0, 8.3, 40.0]), kurtosis)).all()
    assert heavy_tailed(n, 0.0) is n


def test_small_boxes_are_off_by_the_floor() -> None:
    _, n = some()
    box = np.tile([100.0, 100.0, 1.5, 4.0], (len(n), 1))  # shares alone would be 0.18, 0.28 and 0.24 px
    moved = perturb_boxes(box, np.ones(len(n)), BoxNoise(floor_px=0.5), n)
    assert (box_errors(moved, box)[:, :3] * 4.0).std(axis=0) == pytest.approx([0.5] * 3, rel=0.03)
    assert (box_errors(moved, box)[:, 3]).std() == pytest.approx(BoxNoise().width[1], rel=0.05)
    large = np.tile([100.0, 100.0, 30.0, 100.0], (len(n), 1))
    floors = [perturb_boxes(large, np.ones(len(n)), BoxNoise(floor_px=f), n) for f in (0.0, 0.5)]
    assert np.array_equal(*floors)


def test_no_noise_moves_nothing_and_no_box_vanishes() -> None:
    box, n = some(500)
    assert perturb_boxes(box, np.ones(500), BoxNoise(scale=0.0), n) is box
    wild = BoxNoise(foot=(0.0, 3.0), top=(0.0, 3.0), width=(0.0, 5.0))
    assert (perturb_boxes(box, np.ones(500), wild, n)[:, 2:] >= 1.0 - 1e-9).all()


@pytest.mark.parametrize("camera", [pinhole(), above()])
@pytest.mark.parametrize("z", [0.0, 1.2])
def test_feet_are_where_they_project_from(camera, z: float) -> None:
    xyz = np.column_stack([np.random.default_rng(0).uniform(4, 10, (30, 2)), np.full(30, z)])
    uv, _ = project(camera, xyz)
    share = 0.5 if camera.kind == "top" else 1.0
    box = np.column_stack([uv - np.array([10.0, 40.0 * share]), np.full(30, 20.0), np.full(30, 40.0)])
    assert foot_points(box, xyz[:, 2], camera) == pytest.approx(xyz[:, :2])


def drawn(memory: list[Memory], frames: int = 4000, first: int = 1, id: int = 1) -> np.ndarray:
    fresh = np.random.default_rng(id).standard_normal((frames, 3))
    return correlated_normals(fresh, memory, first, 10.0, 7, id, 0)


def test_correlation_is_the_sum_of_the_parts() -> None:
    memory = [Memory(share=0.3, time=0.3), Memory(share=0.5, time=2.0)]
    z = np.stack([drawn(memory, id=k) for k in range(40)])
    assert z.mean() == pytest.approx(0.0, abs=0.03)
    assert z.std() == pytest.approx(1.0, abs=0.02)
    for lag in (1, 3, 10, 30):
        wanted = sum(m.share * np.exp(-lag / (10 * m.time)) for m in memory)
        assert (z[:, lag:] * z[:, :-lag]).mean() == pytest.approx(wanted, abs=0.025)


def test_hidden_feet_shift_a_person_away_from_the_camera_as_far_as_people_can_be_seen() -> None:
    """Nothing is hidden; the feet; all but a head above the horizon."""
    camera = pinhole(10.0)
    whole = np.tile([300.0, 100.0, 40.0, 200.0], (3, 1))
    seen = np.array([[300.0, 100.0, 40.0, height] for height in (200.0, 170.0, 20.0)])
    shift = seen_shift(seen, whole, np.zeros(3), camera)
    lower = np.array([300.0, 270.0, furthest_row(camera)])
    assert lower[2] > 120
    expected = foot_points(np.column_stack([whole[:, :3], lower - 100.0]), np.zeros(3), camera)
    np.testing.assert_allclose(shift, expected - foot_points(whole, np.zeros(3), camera), atol=1e-9)
    assert shift[0].tolist() == [0.0, 0.0]
    assert (np.diff(shift[:, 1]) > 0).all()
