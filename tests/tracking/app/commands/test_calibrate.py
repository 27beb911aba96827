"""`flockscope calibrate`: the camera by boxes and by points, in every kind of source, as other commands read it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sim.scene.camera import to_ground
from sim.types import Camera, Tracks
from tests.boxed_people import CAMERA, boxed, place
from tests.recordings import mot_folder
from tests.refusals import answer, refused
from tracking.app.cli import run
from tracking.recordings.calibration import read_calibration

ROWS = (-2.0, 1.0, 4.0, 8.0, 12.0)
SIZE = "imWidth=640\nimHeight=480\nframeRate=10"
# CAMERA has 500 px; boxes suppose 1.1 widths, 704 px, so that tilt and height differ.
WIDE = {"height": pytest.approx(6, rel=0.25), "tilt_deg": pytest.approx(28.6, abs=8)}


def people() -> list[Tracks]:
    return boxed(place(*ROWS))


def text(tracks: list[Tracks], ids: bool = True) -> str:
    rows = [(t.index, i if ids else -1, *b) for t in tracks if t.box is not None
            for i, b in zip(t.id.tolist(), t.box.tolist(), strict=True)]  # fmt: skip
    return "".join(f"{k},{i},{x:.3f},{y:.3f},{w:.3f},{h:.3f},1,-1,-1,-1\n" for k, i, x, y, w, h in rows)


def cvml(tracks: list[Tracks]) -> str:
    """The boxes as CVML, as the labels of PETS 2009 are distributed."""
    frames = []
    for t in tracks:
        assert t.box is not None
        own = [
            f'<object id="{i}"><box h="{h:.3f}" w="{w:.3f}" xc="{x + w / 2:.3f}" yc="{y + h / 2:.3f}"/></object>'
            for i, (x, y, w, h) in zip(t.id.tolist(), t.box.tolist(), strict=True)
        ]
        frames.append(f'<frame number="{t.index - 1}"><objectlist>{"".join(own)}</objectlist></frame>')
    return f'<?xml version="1.0"?><dataset name="walk">{"".join(frames)}</dataset>'


def test_every_kind_of_source_tells_the_camera_and_takes_it(capsys, tmp_path: Path) -> None:
    tracks = people()
    folder = mot_folder(tmp_path / "walk", gt=text(tracks), ini=SIZE)
    (tmp_path / "walk.txt").write_text(text(tracks))
    (tmp_path / "walk.xml").write_text(cvml(tracks))
    found = {}
    for name, more in (("walk", []), ("walk.txt", ["--fps", 10]), ("walk.xml", ["--fps", 10])):
        out = tmp_path / f"{name}.json"
        size = [] if name == "walk" else ["--image-size", "640,480"]
        found[name] = answer(capsys, "calibrate", tmp_path / name, "--out", out, *more, *size)
        camera = read_calibration(out)
        assert (camera.image, camera.position[2]) == ((640, 480), found[name]["height"])
        answer(capsys, "group", tmp_path / name, "--camera", out, "--out", tmp_path / f"{name} run", *more)
    assert found["walk"].items() >= WIDE.items()
    assert found["walk"]["by"] == "labelled boxes"
    for each in found.values():
        assert each["height"] == pytest.approx(found["walk"]["height"], rel=0.01)
    answer(capsys, "track", "blob", folder, "--detections", "truth", "--out", tmp_path / "run")
    of_run = answer(capsys, "calibrate", tmp_path / "run", "--out", tmp_path / "run.json", "--image-size", "640,480")
    assert of_run.items() >= {"by": "tracked boxes", **WIDE}.items()


def test_the_camera_is_that_of_the_boxes_as_groups_use_it(capsys, tmp_path: Path) -> None:
    from tracking.grouping.ground_of_boxes import fit_ground

    tracks = people()
    folder = mot_folder(tmp_path / "walk", det=text(tracks, ids=False), ini=SIZE)
    found = answer(capsys, "calibrate", folder, "--out", tmp_path / "camera.json", "--px-per-m", 30)
    box = np.concatenate([t.box for t in tracks if t.box is not None]).round(3)
    fit = fit_ground(box, 30.0, (640, 480))
    assert fit is not None
    assert (found["by"], found["height"]) == ("detected boxes", pytest.approx(fit.camera.position[2]))
    assert found["height_interval"][0] <= found["height"] <= found["height_interval"][1]
    twice = answer(capsys, "calibrate", folder, "--out", tmp_path / "camera.json", "--px-per-m", 15)
    assert twice["height"] == pytest.approx(2 * found["height"])


def test_boxes_of_a_file_take_the_place_of_labels(capsys, tmp_path: Path) -> None:
    tracks = people()
    level = [t.replace(box=t.box * [1, 0, 0, 0] + [0, 200, 20, 60]) for t in tracks if t.box is not None]
    folder = mot_folder(tmp_path / "walk", gt=text(level), ini=SIZE)
    (tmp_path / "det.csv").write_text(text(tracks, ids=False))
    line = refused(capsys, "calibrate", folder, "--out", tmp_path / "camera.json")
    assert "800 boxes that do not show the ground: they differ by 0% in height" in line
    assert not (tmp_path / "camera.json").exists()
    found = answer(capsys, "calibrate", folder, "--boxes", tmp_path / "det.csv", "--out", tmp_path / "camera.json")
    assert found.items() >= {"by": "detected boxes", "boxes": 800}.items()


def test_points_give_the_true_camera(capsys, tmp_path: Path) -> None:
    folder, out = mot_folder(tmp_path / "walk", gt=text(people()), ini=SIZE), tmp_path / "camera.json"
    points(tmp_path / "points.csv", CAMERA)
    found = answer(capsys, "calibrate", folder, "--points", tmp_path / "points.csv", "--out", out)
    assert found.items() >= {"by": "points", "points": 5, "height": pytest.approx(6, abs=0.02)}.items()
    np.testing.assert_allclose(read_calibration(out).position, CAMERA.position, atol=0.02)
    assert run(["calibrate", str(folder), "--points", str(tmp_path / "points.csv"), "--out", str(out)]) == 0
    printed = capsys.readouterr()
    assert "height 6.00 ± 0.0" in printed.out
    assert "focal length 500 ± " in printed.out
    assert printed.err == ""
    points(tmp_path / "feet.csv", CAMERA, 3.28)
    run(["calibrate", str(folder), "--points", str(tmp_path / "feet.csv"), "--out", str(out)])
    assert "by this camera half of the people are over 2.4 m tall" in capsys.readouterr().err


def points(path: Path, camera: Camera, unit: float = 1.0) -> None:
    uv = np.array([[60.0, 440], [600, 450], [320, 200], [120, 150], [560, 170]])
    rows = np.column_stack([uv, to_ground(camera, uv) * unit])
    path.write_text("u,v,x,y\n" + "".join(",".join(f"{v:.5f}" for v in row) + "\n" for row in rows))


def test_options_without_effect_or_sense_are_refused(capsys, tmp_path: Path) -> None:
    folder, out = mot_folder(tmp_path / "walk", gt=text(people()), ini=SIZE), tmp_path / "camera.json"
    line = refused(capsys, "calibrate", folder, "--out", out, "--image-size", "640,480")
    assert "--image-size: got 640,480; expected none, as the recording states 640 × 480 px" in line
    (tmp_path / "walk.txt").write_text(text(people()))
    bare = ("calibrate", tmp_path / "walk.txt", "--fps", 10, "--out", out)
    assert "--image-size: got '640'" in refused(capsys, *bare, "--image-size", "640")
    points(tmp_path / "points.csv", CAMERA)
    assert "give --image-size WIDTH,HEIGHT" in refused(capsys, *bare, "--points", tmp_path / "points.csv")
    mot_folder(tmp_path / "other", gt=text(people()), ini=SIZE)
    assert "2 sequences; expected one" in refused(capsys, "calibrate", tmp_path, "--out", out)
    few = mot_folder(tmp_path / "few", gt=text(people()[:5]), ini=SIZE)
    assert "got 50 boxes; expected 100 or more" in refused(capsys, "calibrate", few, "--out", out)
    points_given = (folder, "--points", tmp_path / "points.csv", "--out", out)
    assert "--px-per-m; expected none for points" in refused(capsys, "calibrate", *points_given, "--px-per-m", 40)
    both = mot_folder(tmp_path / "both", gt=text(people()), det=text(people(), ids=False), ini=SIZE)
    line = refused(capsys, "calibrate", both, "--out", out, "--min-score", 0)
    assert "--min-score; expected none for labels" in line
    assert not out.exists()
