"""Where a scenario's camera is placed: everybody in view, as large as possible; what cannot be is refused."""

import json

import numpy as np
import pytest

from scenarios import load
from scenarios.errors import InputError
from scenarios.limits import SCALES, is_number
from scenarios.schema.scenario import CameraSpec
from sim.scene.body import person_boxes
from sim.scene.camera import camera_rotation, px_per_m_at_centre, require_camera
from sim.scene.camera_placement import MARGIN, place_camera
from sim.sequence import simulate
from sim.types import Camera, Motion
from tests.reference_sense import crowd, walkers
from tracking.recordings.calibration import read_calibration


def extremes(camera: Camera, motion: Motion) -> np.ndarray:
    """Left, top, right, bottom of all boxes of all frames."""
    t, p = np.nonzero(motion.present)
    pos3 = np.column_stack([motion.pos[t, p], np.zeros(len(t))])
    box = person_boxes(camera, pos3, motion.heading[t, p], motion.height[p])
    return np.array([*box[:, :2].min(0), *(box[:, :2] + box[:, 2:]).max(0)])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tilt", [0, 10, 40, 65, 90])
def test_solved_views_show_everybody_and_are_tight(seed: int, tilt: float) -> None:
    motion = crowd(seed)
    spec = CameraSpec(tilt_deg=tilt, yaw_deg=37.0 * seed)
    camera = place_camera(spec, motion)
    edge = MARGIN * 480
    left, top, right_, bottom = extremes(camera, motion)
    assert min(left, top) >= edge - 1e-6
    assert right_ <= 640 - edge + 1e-6
    assert bottom <= 480 - edge + 1e-6
    across = abs(left - edge) < 1e-6 and abs(640 - edge - right_) < 1e-6
    along = abs(top - edge) < 1e-6 and abs(480 - edge - bottom) < 1e-6
    assert across or along  # any nearer, and somebody would leave
    assert camera.position[2] > 0
    assert camera.rotation == pytest.approx(camera_rotation(np.deg2rad(tilt), np.deg2rad(37.0 * seed)))


@pytest.mark.parametrize("seed", range(5))
def test_a_given_height_or_position_is_kept(seed: int) -> None:
    motion = crowd(seed)
    free = place_camera(CameraSpec(yaw_deg=0.0), motion)
    tall = place_camera(CameraSpec(height=float(free.position[2]) + 3), motion)
    assert tall.position[2] == free.position[2] + 3
    assert extremes(tall, motion)[1] >= 0
    placed = place_camera(CameraSpec(position=(float(free.position[0]), float(free.position[1]) - 1.0)), motion)
    assert placed.position[:2] == pytest.approx(free.position[:2] - [0, 1])
    lower = placed.replace(position=placed.position - np.array([0, 0, 0.05]))
    left, top, right_, bottom = extremes(lower, motion)
    assert min(left, top, 640 - right_, 480 - bottom) < MARGIN * 480  # the lowest from which all are seen


@pytest.mark.parametrize("seed", range(6))
def test_the_camera_looks_from_where_people_look_largest(seed: int) -> None:
    motion = crowd(seed)
    t, p = np.nonzero(motion.present)
    pos3 = np.column_stack([motion.pos[t, p], np.zeros(len(t))])

    def height(camera: Camera) -> float:
        return float(np.median(person_boxes(camera, pos3, motion.heading[t, p], motion.height[p])[:, 3]))

    tried = [height(place_camera(CameraSpec(yaw_deg=yaw), motion)) for yaw in range(0, 360, 45)]
    chosen = place_camera(CameraSpec(), motion)
    assert height(chosen) > 0.97 * max(tried)  # all frames, and people of different height
    assert np.array_equal(place_camera(CameraSpec(), motion.replace(fps=20.0)).rotation, chosen.rotation)


def test_from_above() -> None:
    motion = crowd(4)
    camera = place_camera(CameraSpec(kind="top"), motion)
    left, top, right_, bottom = extremes(camera, motion)
    edge = MARGIN * 480
    assert min(left - edge, top - edge, 640 - edge - right_, 480 - edge - bottom) == pytest.approx(0, abs=1e-9)
    fixed = place_camera(CameraSpec(kind="top", px_per_m=30, yaw_deg=20), motion)
    assert fixed.px_per_m == 30
    placed = place_camera(CameraSpec(kind="top", position=(8, 5), yaw_deg=20), motion)
    assert placed.position[:2] == pytest.approx([8, 5])


OUT_OF_VIEW = [
    ({"height": 2.0}, "camera.height"),
    ({"position": (8.0, 5.0)}, "camera.position"),
    ({"kind": "top", "px_per_m": 200.0}, "camera.px_per_m"),
]


@pytest.mark.parametrize(("keys", "named"), OUT_OF_VIEW)
def test_people_out_of_view_are_refused(keys: dict[str, object], named: str) -> None:
    motion = crowd(0)
    with pytest.raises(InputError, match="out of view in frame 1 ") as caught:
        place_camera(CameraSpec.model_validate({**keys, "tilt_deg": 40}), motion)
    assert named in caught.value.place
    assert caught.value.file == "scenario made-up"
    place_camera(CameraSpec.model_validate({**keys, "tilt_deg": 40, "crop": True}), motion)


def test_crop_looks_at_the_world_only() -> None:
    motion = walkers([[8, 5], [8, 5]], [[0, 0], [5, 0]], frames=100)  # the second walks 50 m away
    wide, near = place_camera(CameraSpec(), motion), place_camera(CameraSpec(crop=True), motion)
    assert px_per_m_at_centre(near) > 1.5 * px_per_m_at_centre(wide)


DOWN = camera_rotation(0.6, 0.4).tolist()
GOOD = {
    "format": 1, "kind": "pinhole", "image": [640, 480], "focal_px": [500, 500], "centre_px": [320, 240],
    "position": [1, 2, 5], "rotation": DOWN, "baseline": 0, "px_per_m": None,
}  # fmt: skip
TOP = GOOD | {"kind": "top", "px_per_m": 40.0, "rotation": camera_rotation(np.pi / 2, 0.4).tolist()}
CLOSE = GOOD | {"focal_px": [6e4, 6e4], "position": [1, 2, 0.1], "rotation": camera_rotation(1.5, 0.4).tolist()}
MIRRORED = (np.diag([-1.0, 1.0, 1.0]) @ np.array(DOWN)).tolist()
LARGER = (2 * np.array(DOWN)).tolist()

BAD = {
    "mirrored": (GOOD | {"rotation": MIRRORED}, "mirrored"), "scaled": (GOOD | {"rotation": LARGER}, "right angles"),
    "no rotation": (GOOD | {"rotation": [[0, 0, 0]] * 3}, "right angles"),
    "underground": (GOOD | {"position": [1, 2, -5]}, "above the ground"),
    "on the ground": (GOOD | {"position": [1, 2, 0]}, "above the ground"),
    "looking up": (GOOD | {"rotation": camera_rotation(-0.6, 0.0).tolist()}, "sees the ground"),
    "no focal length": (GOOD | {"focal_px": [0, 0]}, "focal"),
    "a negative focal length": (GOOD | {"focal_px": [-500, 500]}, "focal"),
    "mm for px": (GOOD | {"focal_px": [3.5, 3.5]}, "focal"),
    "two unlike focal lengths": (GOOD | {"focal_px": [500, 5000]}, "focal"),
    "no image": (GOOD | {"image": [0, 0]}, "image"), "half a pixel": (GOOD | {"image": [640.5, 480]}, "image"),
    "a huge image": (GOOD | {"image": [16000, 16000]}, "image"),
    "far away": (GOOD | {"position": [1e300, 2, 5]}, "position"),
    "no numbers": (GOOD | {"position": ["1", "2", "5"]}, "position"),
    "a telephoto lens just above the ground": (CLOSE, "px_per_m"),
    "no scale from above": (TOP | {"px_per_m": 0.0}, "px_per_m"),
    "from above, but level": (TOP | {"rotation": DOWN}, "look"), "another format": (GOOD | {"format": 2}, "format"),
    "a format that is no number": (GOOD | {"format": "1"}, "format"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_calibrations(name, tmp_path):
    document, word = BAD[name]
    (tmp_path / "camera.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=word) as error:
        read_calibration(tmp_path / "camera.json")
    assert "camera.json" in str(error.value)


@pytest.mark.parametrize("document", [GOOD, TOP])
def test_good_ones(document, tmp_path):
    (tmp_path / "camera.json").write_text(json.dumps(document))
    camera = read_calibration(tmp_path / "camera.json")
    assert require_camera(camera) is camera
    rounded = np.round(camera.rotation, 3)
    assert require_camera(camera.replace(rotation=rounded)).rotation.tolist() == rounded.tolist()


def test_ground_too_far_away_gives_no_scale(tmp_path):
    """The scale of an image whose centre shows the ground 50 km away lies within the bounds of stored sequences."""
    level, nearly = (GOOD | {"rotation": camera_rotation(tilt, 0.4).tolist()} for tilt in (0.0, 1e-4))
    scales = []
    for k, document in enumerate((level, nearly)):
        (tmp_path / f"{k}.json").write_text(json.dumps(document))
        scales.append(px_per_m_at_centre(read_calibration(tmp_path / f"{k}.json")))
    assert scales[1] == pytest.approx(scales[0], rel=0.01)
    assert is_number(scales[1], *SCALES)


def test_cameras_of_scenarios():
    settings = ["camera.height=5", "camera.position=[8, -4]", "camera.crop=true"]
    assert simulate(load("merge", set=settings), 40000).camera is not None
    with pytest.raises(InputError, match="camera: rotation: got an image without ground"):
        simulate(load("merge", set=[*settings, "camera.tilt_deg=-30"]), 40000)
