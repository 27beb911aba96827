"""The camera of points on the ground: exact points give it back, points that leave it open are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.scene.camera import camera_rotation, to_ground
from sim.types import Camera
from tracking.recordings.camera_of_points import PointFit, camera_of_points, read_points

IMAGE = (768, 576)
SPREAD = np.array([[60.0, 500], [700, 540], [380, 330], [120, 350], [650, 320], [400, 480]])


def camera(tilt: float, focal: float, at: tuple[float, float, float], yaw: float = 0.4) -> Camera:
    view = camera_rotation(np.radians(tilt), yaw)
    return Camera("pinhole", IMAGE, (focal, focal), (384.0, 288.0), np.array(at), view)


def fitted(tmp_path: Path, rows: np.ndarray, head: str = "") -> PointFit:
    text = head + "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in rows)
    (tmp_path / "points.csv").write_text(text)
    return camera_of_points(read_points(tmp_path / "points.csv"), IMAGE)


def seen(view: Camera, uv: np.ndarray = SPREAD) -> np.ndarray:
    return np.column_stack([uv, to_ground(view, uv)])


@pytest.mark.parametrize("count", [4, 6])
@pytest.mark.parametrize(
    ("tilt", "focal", "at"),
    [(20, 850, (3.0, -4.0, 6.0)), (45, 500, (5000.0, 300.0, 12.0)), (12, 1500, (0.0, 0.0, 2.5)), (60, 1000, (1, 1, 9))],
)
def test_exact_points_give_the_camera_back(
    tmp_path: Path, tilt: float, focal: float, at: tuple[float, float, float], count: int
) -> None:
    true = camera(tilt, focal, at)
    fit = fitted(tmp_path, seen(true)[:count])
    assert fit.rms < 0.05
    assert fit.camera.focal_px[0] == pytest.approx(focal, rel=0.01)
    np.testing.assert_allclose(fit.camera.position, true.position, atol=0.02 * at[2])
    np.testing.assert_allclose(fit.camera.rotation, true.rotation, atol=0.01)


def test_errors_of_one_px_are_as_large_as_said(tmp_path: Path) -> None:
    true, r = camera(25, 900, (0.0, 0.0, 5.0)), np.random.default_rng(30_000)
    rows, off = seen(true), []
    for _ in range(40):
        noise = np.column_stack([r.normal(size=(len(rows), 2)), np.zeros((len(rows), 2))])
        fit = fitted(tmp_path, rows + noise)
        tilt = np.arcsin(-fit.camera.rotation[2, 2]) - np.radians(25)
        errors = fit.camera.position[2] - 5, tilt, fit.camera.focal_px[0] - 900
        off.append(np.array(errors) / (fit.height_sd, fit.tilt_sd, fit.focal_sd))
    spread = np.array(off).std(axis=0)
    assert ((spread > 0.6) & (spread < 1.3)).all(), spread


def test_a_first_line_may_name_the_columns_in_another_order(tmp_path: Path) -> None:
    true = camera(20, 850, (3.0, -4.0, 6.0))
    fit = fitted(tmp_path, seen(true)[:, [2, 3, 1, 0]], "# surveyed\nx, y, v, u\n")
    assert fit.camera.position == pytest.approx(true.position, abs=0.05)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[:3], "got 3 points; expected 4 or more"),
        (lambda rows: np.r_[rows[:2], rows[:2]], "points on one line on the picture"),
        (lambda rows: rows * [1, 1, 1, 0], "points on one line on the ground"),
        (lambda rows: rows * [1, 1, 1, -1], "negate all y"),
        (lambda rows: rows + [0, 0, 0, 5] * (np.arange(6) == 2)[:, None], "line 3: got a point"),
        (lambda rows: rows - np.array([100, 0, 0, 0]), "expected a point in the picture of 768 × 576 px"),
    ],
)
def test_points_that_determine_no_camera_are_refused(tmp_path: Path, change, words: str) -> None:
    with pytest.raises(InputError, match=words.replace(".", r"\.")) as refused:
        fitted(tmp_path, change(seen(camera(20, 850, (3.0, -4.0, 6.0)))))
    assert "\n" not in refused.value.line()


def test_points_below_a_camera_that_looks_straight_down_leave_its_focal_length_open(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="focal length open"):
        fitted(tmp_path, seen(camera(90, 850, (3.0, -4.0, 6.0))))


def test_points_of_which_most_lie_near_one_line_leave_the_focal_length_open(tmp_path: Path) -> None:
    rows = [[399, 231, -0.476, 1.155], [193, 191, -1.663, 0.862], [467, 264, -0.057, 1.136], [651, 354, 0.977, 1.089]]
    with pytest.raises(InputError, match="focal length open"):
        fitted(tmp_path, np.array(rows))


def test_a_search_from_one_focal_length_would_end_in_another_minimum(tmp_path: Path) -> None:
    rows = [
        [296.565, 440.112, -0.401, 0.982], [676.191, 458.189, 2.585, -0.639], [586.956, 61.462, 4.441, 3.568],
        [375.371, 373.802, 0.502, 1.223],
    ]  # fmt: skip
    fit = fitted(tmp_path, np.array(rows))
    assert fit.camera.focal_px[0] == pytest.approx(569, rel=0.02)
    assert fit.camera.position[2] == pytest.approx(5.27, abs=0.1)


def test_names_of_other_columns_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 1: got u,v,x,z; expected u,v,x,y"):
        fitted(tmp_path, seen(camera(20, 850, (3.0, -4.0, 6.0))), "u,v,x,z\n")
