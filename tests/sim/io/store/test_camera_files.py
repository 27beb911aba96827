import json

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.store.camera_files import camera_document, read_camera, read_scene, scene_document
from sim.scene.camera import camera_rotation
from sim.types import Camera, Scene


def test_cameras_and_scenes_come_back_exactly(tmp_path, make_sequence, same):
    down = camera_rotation(np.pi / 2, 0.3)
    top = Camera("top", (640, 480), (1.0, 1.0), (320.0, 240.0), np.array([1.7, -2.3, 20.0]), down, 0.0, 40.3)
    for camera in (top, make_sequence(1).camera):
        (tmp_path / "camera.json").write_text(json.dumps(camera_document(camera)))
        same(camera, read_camera(tmp_path / "camera.json"))
    for scene in (Scene(np.array([3.0, 4.0])), make_sequence(1).scene):
        (tmp_path / "scene.json").write_text(json.dumps(scene_document(scene)))
        same(scene, read_scene(tmp_path / "scene.json"))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("kind", "fish"), ("position", [1, 2]), ("rotation", [[1]]), ("focal_px", "wide"), ("image", None),
        ("kind", "top"),
    ],
)  # fmt: skip
def test_bad_cameras_are_one_line(tmp_path, make_sequence, key, value):
    document = camera_document(make_sequence(1).camera) | {key: value}
    (tmp_path / "camera.json").write_text(json.dumps(document))
    with pytest.raises(InputError):
        read_camera(tmp_path / "camera.json")
    del document[key]
    (tmp_path / "camera.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=key):
        read_camera(tmp_path / "camera.json")
