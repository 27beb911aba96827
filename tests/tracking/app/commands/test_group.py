"""`flockscope group`: from people with ids to a sealed run with groups and events; labels of groups are never read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.store.camera_files import camera_document
from sim.store.seal import NAMES, check_run
from sim.store.tables import json_document, plain
from sim.store.track_files import write_tracks
from sim.types import Tracks
from tests.boxed_people import CAMERA, boxed, place
from tests.recordings import mot_folder
from tests.refusals import answer, refused
from tests.sealing import seal_again
from tests.short_scene import write_short_scene
from tracking import group
from tracking.app.cli import run
from tracking.app.group_tables import lasting
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks

FPS = 10.0
Place = Callable[[float], tuple[float, float]]

# Two people walk together, a third joins them, two others walk through them, one stays away.
WALK: dict[int, Place] = {
    1: lambda t: (1 + 1.2 * t, 2.0), 2: lambda t: (1 + 1.2 * t, 2.8),
    3: lambda t: (1 + 1.2 * t, 3.6 + 0.8 * max(0.0, 4 - t)), 4: lambda t: (26 - 1.1 * t, 2.4),
    5: lambda t: (1 + 1.2 * t, 9.0), 6: lambda t: (26 - 1.1 * t, 3.2),
}  # fmt: skip


def text(frames: int = 200, box: str = "-1,-1,-1,-1") -> str:
    """The walk as MOTChallenge text on the ground."""
    rows = [(k, p, *at((k - 1) / FPS)) for k in range(1, frames + 1) for p, at in WALK.items()]
    return "".join(f"{k},{p},{box},1,{x:.3f},{y:.3f},0\n" for k, p, x, y in rows)


def boxes(frames: int = 200, scale: float = 40.0) -> str:
    """The walk as MOTChallenge text of boxes in the image, 40 px per m."""
    rows = [(k, p, *at((k - 1) / FPS)) for k in range(1, frames + 1) for p, at in WALK.items()]
    return "".join(
        f"{k},{p},{scale * x:.2f},{scale * y:.2f},{0.5 * scale:g},{1.7 * scale:g},1,-1,-1,-1\n" for k, p, x, y in rows
    )


def biwi(folder: Path, groups: str | None = "1 2 3\n") -> Path:
    """The walk as a BIWI folder, each fourth frame."""
    folder.mkdir(parents=True)
    rows = [
        (6 * k, p, *at(0.4 * k), *(np.subtract(at(0.4 * k), at(0.4 * k - 0.4)) / 0.4))
        for k in range(50)
        for p, at in WALK.items()
    ]
    (folder / "obsmat.txt").write_text("".join(f"{k} {p} {x} 0 {y} {u} 0 {v}\n" for k, p, x, y, u, v in rows))
    if groups is not None:
        (folder / "groups.txt").write_text(groups)
    return folder


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    path = tmp_path / "walk.txt"
    path.write_text(text())
    return path


def told(tracks: Tracks) -> list[dict]:
    return [plain(e) for e in tracks.events]


def content(folder: Path) -> dict[str, bytes]:
    """The files of a run, without what run.json tells of the labels."""
    found = {name: (folder / name).read_bytes() for name in NAMES if (folder / name).exists()}
    told = json.loads(found.pop("run.json"))
    return {**found, "run.json": json.dumps({**told, "truth_hash": "", "sha256": ""}).encode()}


def test_a_text(walk, tmp_path, capsys):
    found = answer(capsys, "group", walk, "--fps", 10, "--out", tmp_path / "g")
    (row,) = found["runs"]
    assert (row["sequence"], row["people"], row["people_in_groups"], row["plane"]) == ("walk", 6, 5, "ground")
    one, other = row["groups"]
    known = (other["members"], other["size"], lasting([*row["groups"], {"seconds": 1.9}, {"seconds": 2.0}]))
    assert known == ([4, 6], 2, 3)
    assert (one["members"], one["size"], one["end"]) == ([1, 2, 3], 3, 200)
    assert one["seconds"] == (200 - one["start"] + 1) / FPS
    assert {kind: n for kind, n in row["events"].items() if n} == {"merge": 1, "cross": 1}
    told = check_run(tmp_path / "g")
    assert told["truth_hash"] is None, "the rows of a text are no labels"
    tracks = read_tracks(tmp_path / "g")
    assert [t.group[:2].tolist() for t in tracks[20:]] == [[1, 1]] * 180
    (merge,) = (e for t in tracks for e in t.events if e.kind == "merge")
    assert merge.members == (1, 2, 3)


@pytest.mark.parametrize("groups", [None, "", "1 4\n2 5\n", "1 2 3 4 5\n"])
def test_labels_of_groups_are_never_read(tmp_path, capsys, groups):
    labelled = [biwi(tmp_path / k / "walk", labels) for k, labels in (("a", "1 2 3\n"), ("b", groups))]
    for folder in labelled:
        answer(capsys, "group", folder, "--out", folder.parent / "g")
        assert "error" not in answer(capsys, "view", folder, folder.parent / "g", "--out", folder.parent / "g.html")
    first, second = (content(folder.parent / "g") for folder in labelled)
    assert first == second
    (row,) = answer(capsys, "score", labelled[0], tmp_path / "a" / "g")["sequences"]
    assert row["pairwise_F1"] > 0.7
    assert "tracks of another walk" in refused(capsys, "score", labelled[0], tmp_path / "b" / "g") or groups is None


@pytest.mark.parametrize("form", ["ground text", "folder of boxes", "biwi"])
def test_nothing_later_is_used(tmp_path, capsys, form):
    """The first part of a recording alone has the same groups, and the events that were known by then."""
    cut = 120
    found = []
    for name, frames in (("whole", 200), ("part", cut)):
        folder, options = tmp_path / name, ["--fps", "10", "--px-per-m", "40"]
        if form == "biwi":
            source, options, cut = biwi(folder / "walk"), [], 30
            rows = (source / "obsmat.txt").read_text().splitlines(keepends=True)
            (source / "obsmat.txt").write_text("".join(rows[: len(WALK) * (50 if name == "whole" else cut)]))
        else:
            source = mot_folder(folder / "walk", text(frames) if form == "ground text" else boxes(frames))
            source = source / "gt" / "gt.txt" if form == "ground text" else source
        answer(capsys, "group", source, *options, "--out", folder / "g")
        found.append(read_tracks(folder / "g")[: cut - 1])
    for a, b in zip(*found, strict=True):
        assert np.array_equal(a.group, b.group)
        assert told(a) == told(b)
        assert np.array_equal(a.vel, b.vel, equal_nan=True)
    assert any(t.events for t in found[0])


def test_a_run(walk, tmp_path, capsys):
    """Its tracker and what it got stay; its groups and their rule are replaced; its labels still are its own."""
    write_short_scene(tmp_path, "40000:40002")
    data, first = tmp_path / "data", tmp_path / "blob"
    (tmp_path / "far.toml").write_text("[params]\nnear = 0.5\n")
    (tmp_path / "soon.toml").write_text("[params]\nacquaintance = 0.2\n")
    line = ["blob", data, "--detections", "truth", "--grouping", tmp_path / "far.toml"]
    answer(capsys, "track", *line, "--out", first)
    found = answer(capsys, "group", first, "--grouping", tmp_path / "soon.toml", "--out", tmp_path / "again")
    assert [row["sequence"] for row in found["runs"]] == ["scene-s40000", "scene-s40001"]
    assert [len(row["groups"]) for row in found["runs"]] == [1, 1]
    before, after = (check_run(folder / "scene-s40001") for folder in (first, tmp_path / "again"))
    assert (before["grouping"]["near"], after["grouping"]["near"], after["grouping"]["acquaintance"]) == (0.5, 1.5, 0.2)
    assert all(before[key] == after[key] for key in ("tracker", "config", "truth_hash", "detections", "px_per_m"))
    answer(capsys, "group", tmp_path / "again" / "scene-s40000" / "tracks.parquet", "--out", tmp_path / "third")
    assert check_run(tmp_path / "third")["grouping"]["grouping"] == "belief", "the default"
    for folder in (first, first / "scene-s40000"):
        assert "the folder of the tracks themselves" in refused(capsys, "group", folder, "--out", folder)


def test_probabilities(walk, tmp_path, capsys):
    """A table of pairs, sealed with the run; a run without the option has none."""
    line = ["group", walk, "--fps", 10, "--out", tmp_path / "g"]
    (row,) = answer(capsys, *line, "--probabilities")["runs"]
    table = pq.read_table(tmp_path / "g" / "pairs.parquet")
    assert table.column_names == ["frame", "a", "b", "probability"]
    frame, a, b, p = (table[name].to_numpy() for name in table.column_names)
    assert row["pairs"] == len(frame)
    assert (a < b).all()
    assert ((p > 0) & (p < 1)).all()
    last = {(i, j): q for k, i, j, q in zip(frame, a, b, p, strict=True) if k == 200}
    assert min(last[1, 2], last[2, 3], last[4, 6]) > 0.5
    assert frame.min() <= 10
    assert run(["validate", str(tmp_path / "g")]) == 0
    assert (tmp_path / "g" / "pairs.parquet").is_file()
    (row,) = answer(capsys, *line)["runs"]
    assert row["pairs"] is None
    assert not (tmp_path / "g" / "pairs.parquet").exists()


@pytest.fixture
def seen_from_above(tmp_path: Path) -> tuple[Path, list]:
    """Tracked boxes of two people near the camera and two far from it, and the option with its calibration."""
    info = {"tracker": "mine.py:Mine", "plane": "image", "input": "boxes", "ground": "camera", "px_per_m": 40.0}
    write_tracks(tmp_path / "boxes", boxed(place(2.0, 14.0)), fps=FPS, info=info)
    (tmp_path / "above.json").write_bytes(json_document(camera_document(CAMERA)))
    return tmp_path / "boxes", ["--camera", tmp_path / "above.json"]


def probabilities(folder: Path) -> dict[tuple[int, int], float]:
    """The mean probability of each pair."""
    table = pq.read_table(folder / "pairs.parquet").to_pydict()
    pairs = list(zip(table["a"], table["b"], strict=True))
    return {
        pair: np.mean([p for q, p in zip(pairs, table["probability"], strict=True) if q == pair]) for pair in {*pairs}
    }


def test_probabilities_are_of_the_places_on_the_ground(seen_from_above, tmp_path, capsys):
    """1 m apart is the same far and near; by one scale of the image it is not."""
    boxes, camera = seen_from_above
    answer(capsys, "group", boxes, "--fps", 10, *camera, "--probabilities", "--out", tmp_path / "g")
    found = probabilities(tmp_path / "g")
    assert found.keys() == {(1, 2), (3, 4)}, "the others are 12 m away"
    assert found[1, 2] == pytest.approx(found[3, 4], abs=0.05)
    assert check_run(tmp_path / "g")["ground"] == "camera"


def test_a_run_of_boxes_does_not_hold_its_camera(seen_from_above, tmp_path, capsys):
    boxes, camera = seen_from_above
    line = [str(word) for word in ["group", boxes, "--fps", 10, "--out", tmp_path / "g"]]
    assert run(line) == 0
    assert "give it with --camera" in capsys.readouterr().err
    assert check_run(tmp_path / "g")["ground"] != "camera"
    assert run([*line, *map(str, camera)]) == 0
    assert "--camera" not in capsys.readouterr().err
    assert check_run(tmp_path / "g")["ground"] == "camera"


def test_boxes(tmp_path, capsys):
    """In the image by the scale that is given, or that of the first boxes; on the ground by a camera."""
    (tmp_path / "walk.txt").write_text(boxes())
    (row,) = answer(capsys, "group", tmp_path / "walk.txt", "--fps", 10, "--out", tmp_path / "a")["runs"]
    assert (row["plane"], row["px_per_m"], row["px_per_m_frames"]) == ("image", 40, 17)
    assert [g["members"] for g in row["groups"]] == [[1, 2, 3], [4, 6]]
    # 300 boxes tell whether they show the ground
    assert (check_run(tmp_path / "a")["causal_from"], check_run(tmp_path / "a")["ground"]) == (50, None)
    options = ["--fps", 10, "--px-per-m", 400]
    (row,) = answer(capsys, "group", tmp_path / "walk.txt", *options, "--out", tmp_path / "b")["runs"]
    assert (row["px_per_m"], row["px_per_m_frames"], row["people_in_groups"]) == (400, 0, 6)
    camera = {
        "kind": "top", "image": [1600, 800], "focal_px": [40, 40], "centre_px": [800, 400], "position": [20, 10, 10],
        "rotation": [[1, 0, 0], [0, -1, 0], [0, 0, -1]], "baseline": 0, "px_per_m": 40,
    }  # fmt: skip
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    options = ["--fps", 10, "--camera", tmp_path / "camera.json"]
    (row,) = answer(capsys, "group", tmp_path / "walk.txt", *options, "--out", tmp_path / "c")["runs"]
    assert row["plane"] == "ground"
    assert [g["members"] for g in row["groups"]] == [[1, 2, 3], [4, 6]]


def every_tenth() -> str:
    """The walk, of which each tenth frame is labelled."""
    rows = (line.partition(",") for line in text().splitlines())
    return "".join(f"{10 * int(frame) - 9},{rest}\n" for frame, _, rest in rows)


SPEEDS = [
    (every_tenth, ["--fps", "10"], "--fps 10 if the labels have this rate, --fps 1 if the video has it"),
    (text, ["--fps", "100"], "check their unit, and the frame rate"),
    (boxes, ["--fps", "10", "--px-per-m", "4"], "--px-per-m, here 4"),
    (boxes, ["--fps", "10"], ""),
]


@pytest.mark.parametrize(("rows", "options", "expected"), SPEEDS)
def test_speeds_that_nobody_has(tmp_path, capsys, rows, options, expected):
    (tmp_path / "walk.txt").write_text(rows())
    assert run(["group", str(tmp_path / "walk.txt"), *options, "--out", str(tmp_path / "g")]) == 0
    warned = capsys.readouterr().err
    assert expected in warned
    assert bool(warned) == bool(expected)


def test_wrong_options(walk, tmp_path, capsys):
    here = ["group", walk, "--fps", "10", "--out", tmp_path / "g"]
    (tmp_path / "blob.toml").write_text('tracker = "blob"\n[params]\ngate = 0.9\n')
    assert "blob.toml" in refused(capsys, *here, "--grouping", tmp_path / "blob.toml")
    (tmp_path / "wrong.toml").write_text("[params]\nnaer = 1.0\n")
    assert "naer" in refused(capsys, *here, "--grouping", tmp_path / "wrong.toml")
    assert "none.toml" in refused(capsys, *here, "--grouping", tmp_path / "none.toml")
    assert "leave --grouping out" in refused(capsys, *here, "--grouping", "rule", "--probabilities")
    folder = biwi(tmp_path / "biwi")
    assert "--px-per-m" in refused(capsys, "group", folder, "--px-per-m", "40", "--out", tmp_path / "g")
    assert not (tmp_path / "g").exists()
    (tmp_path / "g").mkdir()
    (tmp_path / "g" / "groups.csv").write_text("mine")
    assert "groups.csv: got a file of another program" in refused(capsys, *here)
    assert (tmp_path / "g" / "groups.csv").read_text() == "mine"


def test_wrong_runs(walk, tmp_path, capsys):
    answer(capsys, "group", walk, "--fps", 10, "--out", tmp_path / "g")
    line = ["group", tmp_path / "g", "--out", tmp_path / "h"]
    for option in (["--fps", "10"], ["--px-per-m", "40"], ["--camera", "none.json"]):
        assert f"got {option[0]}; expected none for a run" in refused(capsys, *line, *option)
    answer(capsys, "track", "group-pda", walk, "--fps", 10, "--out", tmp_path / "wholes")
    assert "tracks of whole groups" in refused(capsys, "group", tmp_path / "wholes", "--out", tmp_path / "h")
    (tmp_path / "g" / "events.json").unlink()
    assert "events.json: got missing" in refused(capsys, *line)


def test_a_run_in_the_image_without_scale(tmp_path, capsys):
    (tmp_path / "walk.txt").write_text(boxes(30))
    answer(capsys, "group", tmp_path / "walk.txt", "--fps", 10, "--out", tmp_path / "g")
    tracks = [t.replace(box=None) for t in read_tracks(tmp_path / "g")]
    write_tracks(tmp_path / "mine", tracks, fps=FPS, info={"tracker": "mine.py:Mine", "plane": "image"})
    line = ["group", tmp_path / "mine", "--fps", 10, "--out", tmp_path / "h"]
    assert "give --px-per-m" in refused(capsys, *line)
    (row,) = answer(capsys, *line, "--px-per-m", 40)["runs"]
    assert row["px_per_m"] == 40
    seal_again(tmp_path / "mine", px_per_m=40.0)
    (row,) = answer(capsys, *line)["runs"]
    assert row["px_per_m"] == 40


# Settings of a camera among the people, with the horizon in the middle of the picture of 640 × 480.
LOW_CAMERA = [f"camera.{setting}" for setting in ("tilt_deg=0", "height=2.5", "position=[12,12]", "crop=true")]


def test_boxes_above_the_horizon_of_a_camera(tmp_path, capsys):
    camera = simulate(load("merge", LOW_CAMERA), 90001).camera
    (tmp_path / "walk.txt").write_text("1,1,10,10,20,50\n2,1,11,10,20,50\n1,2,10,291,27,109\n2,2,11,291,27,109\n")
    (walk,) = open_source(tmp_path / "walk.txt", fps=10, camera=camera)
    with pytest.raises(InputError, match="no position on the ground, as in 2 of 4 rows") as error:
        group(walk)
    assert "leave --camera out" in error.value.remedy
