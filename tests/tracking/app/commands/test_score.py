"""`flockscope score`: scores from files equal those of evaluate; group matching, paired differences, tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.store.track_files import write_tracks
from sim.types import Sequence
from tests.groups_as_wholes import wholes
from tests.refusals import answer, refused
from tests.sealing import seal_again
from tests.short_scene import write_short_scene
from tracking import track
from tracking.app.cli import run
from tracking.running.run import TrackingRun
from tracking.scoring import evaluate
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.ground_or_image import in_one_plane
from tracking.stats import mean_interval

SLOW = ["camera.fps=5"]


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Two seeds of a scene with a merge; blob's tracks from its sensor's detections, and from the truth."""
    folder = tmp_path_factory.mktemp("score")
    line = ["generate", "merge", "--seeds", "5:7", "--streams", "none", "--set", *SLOW]
    assert run([*line, "--out", str(folder / "data")]) == 0
    for name in ("file", "truth"):
        options = ["--detections", name, "--out", str(folder / name)]
        assert run(["track", "blob", str(folder / "data"), *options]) == 0
    return folder


@pytest.fixture
def one(made: Path) -> Path:
    return made / "data" / "flockscope-train" / "merge-s00005"


@pytest.fixture(scope="module")
def scene() -> Sequence:
    return simulate(load("merge", SLOW), 5)


@pytest.fixture(scope="module")
def tracked(scene: Sequence) -> TrackingRun:
    return track("blob", scene, detections="file")


@pytest.mark.parametrize("by", ["hull", "members"])
def test_files_are_memory(made: Path, scene: Sequence, tracked: TrackingRun, capsys, by: str) -> None:
    row, _ = answer(capsys, "score", made / "data", made / "file", "--group-match", by)["sequences"]
    expected = evaluate(scene.truth, tracked, group_match=by)
    assert (row["name"], row["group_match"], row["surface"]) == ("merge-s00005", by, "ground")
    for key, value in expected.items():
        assert row[key] == (None if np.isnan(value) else pytest.approx(value, abs=1e-12)), key


@pytest.mark.parametrize("plane", ["ground", "image"])
def test_files_are_memory_for_groups_as_wholes(one: Path, scene: Sequence, tmp_path: Path, capsys, plane: str) -> None:
    """Hulls, extents, sizes and events come back exactly, and with them every score; of people there is none."""
    answers = wholes(scene, plane)
    folder = tmp_path / one.name
    write_tracks(folder, answers, fps=scene.fps, camera=scene.camera, scene=scene.scene)
    for by in ("hull", "members"):
        (row,) = answer(capsys, "score", one, folder, "--group-match", by)["sequences"]
        expected = evaluate(scene.truth, answers, group_match=by)
        assert row["surface"] == plane
        assert expected["group_F1"] > 0.8
        assert expected["merge_F1"] == 1
        assert all(np.isnan(expected[key]) for key in ("HOTA", "MOTA", "IDF1", "GOSPA"))
        for key, value in expected.items():
            assert row[key] == (None if np.isnan(value) else pytest.approx(value, abs=1e-12)), key


def test_no_mean_over_what_trackers_saw_differently(made: Path, tmp_path: Path, capsys) -> None:
    """A seed tracked from its sensor's boxes, one from labels, one from noisy ones, one as a text without run.json."""
    write_short_scene(tmp_path, "3:7")
    data, tracks = tmp_path / "data" / "flockscope-train", tmp_path / "tracks"
    noisy = ["truth", "--set", "sensor.box_noise.scale=2"]
    for seed, mode in zip((3, 4, 5), (["file"], ["truth"], noisy), strict=True):
        name = f"scene-s{seed:05d}"
        assert run(["track", "blob", str(data / name), "--detections", *mode, "--out", str(tracks / name)]) == 0
    assert run(["track", "blob", str(data / "scene-s00006"), "--out", str(tmp_path / "other")]) == 0
    (tracks / "scene-s00006.txt").write_bytes((tmp_path / "other" / "tracks.mot.txt").read_bytes())
    found = answer(capsys, "score", tmp_path / "data", tracks)
    expected = ["file", "truth", "truth (box_noise.scale = 2)", ""]
    assert [row["given"] for row in found["sequences"]] == expected
    assert found["mean"] is None
    assert run(["score", str(tmp_path / "data"), str(tracks)]) == 0
    text = capsys.readouterr().out
    assert "detections file and truth and truth (box_noise.scale = 2) and unknown (no run.json)\n" in text
    assert "95 % low" not in text
    assert "no mean: " in text


def test_the_mean_has_every_key_and_an_interval(made: Path, one: Path, capsys) -> None:
    found = answer(capsys, "score", made / "data", made / "file")
    assert list(found["mean"]) == list(CATALOGUE)
    first, second = (row["pairwise_F1"] for row in found["sequences"])
    mean = found["mean"]["pairwise_F1"]
    assert mean["mean"] == pytest.approx((first + second) / 2)
    _, low, high = mean_interval(np.array([[first], [second]]))
    assert (mean["low"], mean["high"]) == (max(0.0, low[0]), min(1.0, high[0])), "within the score's range"
    assert found["mean"]["cross_F1"] == {"mean": None, "low": None, "high": None, "indicative": True}
    alone = answer(capsys, "score", one, made / "file")["mean"]["HOTA"]
    assert alone["low"] is alone["high"] is None


@pytest.fixture
def in_image(scene: Sequence, tracked: TrackingRun, tmp_path: Path) -> Path:
    """blob's run at the centres of its boxes in the image, as if it was from pixels."""
    (answers,), _ = in_one_plane(scene.truth, [tracked], [False], "image")
    info = {"tracker": "blob", "sequence": "merge-s00005", "plane": "image", "fps": scene.fps, "detections": "image"}
    folder = tmp_path / "image"
    write_tracks(folder / "merge-s00005", answers, fps=scene.fps, camera=scene.camera, scene=scene.scene, info=info)
    return folder


def test_boxes_are_compared_by_their_feet_if_the_camera_is_known(made: Path, one: Path, in_image: Path, capsys) -> None:
    """A text of boxes was scored by overlap beside tracks on the ground; its HOTA was .26 lower for the same tracks."""
    seal_again(in_image / "merge-s00005", detections="file")
    text = in_image.parent / "merge-s00005.txt"
    text.write_text((in_image / "merge-s00005" / "tracks.mot.txt").read_text())
    (ground,) = answer(capsys, "score", one, made / "file")["sequences"]
    for path in (in_image, text):
        (row,) = answer(capsys, "score", one, path)["sequences"]
        assert (row["similarity"], row["surface"]) == ("ground", "ground")
        assert row["HOTA"] == pytest.approx(ground["HOTA"], abs=0.1)
        assert row["HOTA"] > answer(capsys, "score", one, path, "--similarity", "boxes")["sequences"][0]["HOTA"] + 0.05


def test_two_runs_of_one_recording(made: Path, one: Path, capsys) -> None:
    """Resampled frames were joined, and each join was a switch: IDSW 24 had the interval [46, 76]."""
    found = answer(capsys, "score", one, made / "truth", made / "file", "--blocks", "200")
    (pair,), alone = found["differences"], answer(capsys, "score", one, made / "truth", "--blocks", "200")["mean"]
    assert (pair["run"], pair["minus"]) == ("truth", "file")
    known = 0
    for key, d in pair["scores"].items():
        if d["low"] is not None:
            known += 1
            assert d["low"] <= d["mean"] <= d["high"], key
    assert known > 30
    assert pair["scores"]["HOTA"]["low"] > 0
    assert pair["scores"]["HOTA"]["sure"] == "better"
    assert (pair["scores"]["GOSPA"]["mean"] < 0, pair["scores"]["GOSPA"]["sure"]) == (True, "better")
    best = next(row for row in found["ranking"] if row["run"] == "truth")
    assert [best[part] for part in ("mean", "low", "high")] == [alone["objective"][p] for p in ("mean", "low", "high")]
    assert answer(capsys, "score", one, made / "file", made / "truth", "--blocks", "200") == found


def test_runs_are_compared_in_one_plane(made: Path, one: Path, in_image: Path, capsys) -> None:
    """One run is from pixels, the other on the ground: metres were subtracted from pixels."""
    alone = answer(capsys, "score", one, made / "file")["sequences"][0]
    assert (alone["similarity"], alone["surface"]) == ("ground", "ground")
    found = answer(capsys, "score", one, made / "file", in_image)
    assert found["similarity"] == "image"
    (scores,) = found["scores"]["file"].values()
    assert scores["GOSPA"] > 5 * alone["GOSPA"], "px"
    (pair,) = found["differences"]
    assert {pair["scores"][key]["mean"] for key in ("GOSPA", "HOTA", "group_F1")} == {0.0}


def test_runs_that_fit_no_plane_are_refused(made: Path, one: Path, scene: Sequence, in_image: Path, capsys) -> None:
    folder = in_image.parent / "wholes"
    write_tracks(folder / "merge-s00005", wholes(scene, "ground"), fps=scene.fps)
    error = refused(capsys, "score", one, folder, in_image)
    assert "runs in the image (px), and one on the ground (m) with groups without people" in error
    assert run(["score", str(one), str(folder), str(made / "file")]) == 0
