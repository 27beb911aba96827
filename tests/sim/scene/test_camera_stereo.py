"""A stereo pair as a sensor of points: projection and back, the Jacobian, how the depth error grows."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.camera import back_project, camera_rotation, disparity, pair_jacobian, project, project_pair, to_ground
from sim.types import Camera


def rig(tilt: float, yaw: float = 0.0, height: float = 5.1, focal: float = 246.0, baseline: float = 0.12) -> Camera:
    """The paper's camera: 320 x 240 px; tilt and yaw in degrees."""
    turn = camera_rotation(np.radians(tilt), np.radians(yaw))
    return Camera(
        "pinhole", (320, 240), (focal, 1.1 * focal), (160.0, 120.0), np.array([1, -2, height]), turn, baseline
    )


def seen_points(camera: Camera, seed: int, count: int = 20) -> np.ndarray:
    """Points in front of the camera, 3 to 15 m away."""
    r = np.random.default_rng(seed)
    x = np.column_stack([r.uniform(-3, 3, count), r.uniform(-2, 2, count), r.uniform(3, 15, count)])
    return x @ camera.rotation + camera.position


POSES = [(40.0, 0.0), (0.0, 30.0), (75.0, -120.0), (-10.0, 200.0)]


@pytest.mark.parametrize("pose", POSES)
def test_there_and_back(pose) -> None:
    camera = rig(*pose)
    X = seen_points(camera, 1)
    uvd = project_pair(camera, X)
    uv, depth = project(camera, X)
    assert np.allclose(uvd[:, :2], uv, atol=1e-9)
    assert np.allclose(uvd[:, 2], disparity(camera, depth), atol=1e-9)
    assert np.allclose(back_project(camera, uvd), X, atol=1e-9)
    assert np.allclose(project_pair(camera, back_project(camera, uvd)), uvd, atol=1e-9)
    right = camera.replace(position=camera.position + camera.baseline * camera.rotation[0])
    assert np.allclose(uv[:, 0] - project(right, X)[0][:, 0], uvd[:, 2], atol=1e-9)


@pytest.mark.parametrize("pose", POSES)
def test_the_jacobian_is_that_of_central_differences(pose) -> None:
    camera = rig(*pose)
    X, step = seen_points(camera, 2), 1e-5
    numeric = [project_pair(camera, X + step * e) - project_pair(camera, X - step * e) for e in np.eye(3)]
    J = pair_jacobian(camera, X)
    assert np.abs(J - np.stack(numeric, 2) / (2 * step)).max() < 1e-6
    z = ((X - camera.position) @ camera.rotation.T)[:, 2]
    fx, fy = camera.focal_px
    assert np.linalg.det(J) == pytest.approx(-camera.baseline * fx**2 * fy / z**4, rel=1e-9)


def test_the_ground_on_the_axis_of_the_papers_camera() -> None:
    """It lies at range h / sin(tilt) = 7.93 m."""
    camera = rig(40.0)
    on_axis = np.append(to_ground(camera, np.array([[160.0, 120.0]]))[0], 0.0)
    assert np.linalg.norm(on_axis - camera.position) == pytest.approx(7.93, abs=0.01)
    assert project_pair(camera, on_axis[None])[0, 2] == pytest.approx(246 * 0.12 / 7.93, abs=0.01)
