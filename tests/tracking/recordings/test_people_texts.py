"""Texts of TrajNet++, ETH and UCY, PedPy and JuPedSim, boxes of KITTI's tracking, and group labels of texts."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Sequence
from tests.recordings import mot_folder
from tracking.grouping.known_people import known_people
from tracking.recordings.source import open_source

PLACES = [(780, 1, 8.46, 3.59), (790, 1, 9.57, 3.79), (790, 2, 9.57, 4.79), (810, 2, 10.57, 4.79)]
TRAJNET = '{"scene": {"id": 0, "p": 1, "s": 780, "e": 810, "fps": 2.5, "tag": [1, []]}}\n' + "".join(
    f'{{"track": {{"f": {f}, "p": {p}, "x": {x}, "y": {y}}}}}\n' for f, p, x, y in PLACES
)
ETH = "".join(f"{f:.1f}\t{p:.1f}\t{x}\t{y}\n" for f, p, x, y in PLACES)
PETRACK = (
    "# PeTrack project: hall.pet\n# framerate: 16.00 fps\n# id frame x/cm y/cm z/cm\n1 0 846 359 170\n1 1 957 379 170\n"
    "2 1 957 479 170\n2 3 1057 479 170\n"
)
JUPEDSIM = (
    "# description: jpscore\n# framerate: 8.00\n# geometry: hall.xml\n# ID\tFR\tX\tY\tZ\tA\tB\tANGLE\tCOLOR\n"
    + "".join(f"{p}\t{f // 10}\t{x}\t{y}\t0.00\t0.30\t0.30\t12.0\t255\n" for f, p, x, y in PLACES)
)
TEXTS = {"walk.ndjson": TRAJNET, "walk.txt": ETH, "hall.txt": PETRACK, "room.txt": JUPEDSIM}
KITTI = "".join(
    f"{line} 1.7 0.6 0.8 1.0 1.6 9.0 0.2{score}\n"
    for line, score in [
        ("0 -1 DontCare -1 -1 -10 219.3 188.5 245.5 218.6", ""),
        ("0 0 Pedestrian 0 0 -0.3 100.0 150.0 130.5 230.0", ""),
        ("1 0 Pedestrian 0 1 -0.3 103.0 150.0 133.0 230.0", ""),
        ("1 2 Car 0 0 -0.3 296.7 161.7 455.2 292.3", ""),
        ("2 5 Person_sitting 0 2 -0.3 10.0 150.0 40.0 210.0", " 0.8"),
        ("3 -1 DontCare -1 -1 -10 219.3 188.5 245.5 218.6", ""),
        ("2 0 Pedestrian 1 0 -0.3 106.0 150.0 136.0 230.0", ""),
        ("1 7 Pedestrian 0 3 -0.3 203.0 150.0 233.0 230.0", ""),
    ]
)
RATES = {"walk.ndjson": 2.5, "walk.txt": 2.5, "hall.txt": 16.0, "room.txt": 8.0}


def opened(folder: Path, name: str, text: str, **options) -> Sequence:
    (folder / name).write_text(text, encoding="utf-8")
    return open_source(folder / name, **options)[0]


@pytest.mark.filterwarnings("ignore:trajectories without a frame rate")
@pytest.mark.parametrize("name", TEXTS)
def test_frames_positions_and_rate(tmp_path, name):
    sequence = opened(tmp_path, name, TEXTS[name])
    truth = sequence.truth
    assert (sequence.fps, sequence.length, truth.fps) == (RATES[name], 4, RATES[name])
    assert truth.frame.tolist() == [1, 2, 2, 4]
    assert truth.id.tolist() == [1, 1, 2, 2]
    assert truth.pos == pytest.approx(np.array([p[2:] for p in PLACES]))
    assert not truth.labelled.any()


def test_people_with_boxes(tmp_path):
    sequence = opened(tmp_path, "0012.txt", KITTI)
    truth = sequence.truth
    assert (sequence.fps, sequence.length, sequence.has_detections) == (10.0, 4, False)
    assert list(zip(truth.frame.tolist(), truth.id.tolist(), strict=True)) == [(1, 0), (2, 0)]
    np.testing.assert_allclose(truth.box[0], [100, 150, 30.5, 80])
    assert truth.pos is None


def test_labels_that_kitti_does_not_count_are_unscored(tmp_path):
    """Regions, seated people, people outside the picture in part, and people who are hidden for the most part."""
    unscored = opened(tmp_path, "0012.txt", KITTI).truth.unscored
    assert unscored.frame.tolist() == [1, 2, 3, 3, 4]
    assert unscored.region.tolist() == [True, False, False, False, True]
    assert unscored.distractor.tolist() == [False, True, True, True, False]
    np.testing.assert_allclose(unscored.box[[0, 2]], [[219.3, 188.5, 26.2, 30.1], [10, 150, 30, 60]])
    assert unscored.min_height == 25


def test_other_classes_are_named(tmp_path):
    """Many recordings have no pedestrians. They are scored nevertheless, as tracks there are false."""
    cars = opened(tmp_path, "0012.txt", KITTI, person_class="Car").truth
    assert (cars.frame.tolist(), cars.id.tolist()) == ([2], [2])
    with pytest.warns(UserWarning, match=r"no pedestrian, only car, dontcare, person_sitting \(--class names others\)"):
        truth = opened(tmp_path, "0013.txt", KITTI.replace("Pedestrian", "Car")).truth
    assert (len(truth.frame), truth.length) == (0, 4)
    with pytest.raises(InputError, match=r"--class: got car, dontcare.*expected tram; name some of these"):
        opened(tmp_path, "0014.txt", KITTI, person_class="tram")


def test_the_rate_of_eth_is_assumed_with_a_warning(tmp_path):
    with pytest.warns(UserWarning, match=r"trajectories without a frame rate: taken at 2\.5 fps"):
        opened(tmp_path, "walk.txt", ETH)
    assert opened(tmp_path, "walk.txt", ETH, fps=5).fps == 5
    assert opened(tmp_path, "walk.txt", "# Zara\n" + ETH.replace("\t", " "), fps=5).truth.frame.tolist() == [1, 2, 2, 4]


@pytest.mark.filterwarnings("ignore:trajectories without a frame rate")
@pytest.mark.parametrize("name", TEXTS)
def test_groups_are_found_without_a_look_ahead(tmp_path, name):
    """Velocities of the labels are differences over a centred window."""
    sequence = opened(tmp_path, name, TEXTS[name])
    assert np.isfinite(sequence.truth.vel).all()
    assert all(np.isnan(tracks.vel).all() for tracks in known_people(sequence))


def test_a_folder_of_ndjson_is_a_dataset(tmp_path):
    for path in (tmp_path / "a.ndjson", tmp_path / "one" / "b.ndjson", tmp_path / "two" / "b.ndjson"):
        path.parent.mkdir(exist_ok=True)
        path.write_text(TRAJNET)
    with pytest.warns(UserWarning, match="b is the name of 2 sequences"):
        assert [s.name for s in open_source(tmp_path)] == ["one", "two", "a"]


BAD = {
    "no JSON": ("a.ndjson", TRAJNET + "{\n", "line 6: got no JSON"),
    "no track": ("a.ndjson", TRAJNET + '{"row": 1}\n', "line 6: got"),
    "no number": ("a.ndjson", TRAJNET.replace("8.46", '"8.46"'), "line 2: got"),
    "a bool": ("a.ndjson", TRAJNET.replace("8.46", "true"), "line 2: got"),
    "two rates": ("a.ndjson", TRAJNET + TRAJNET.replace("2.5", "10"), "line 6: got fps 10; expected 2.5"),
    "no row": ("a.ndjson", "", "got no row"),
    "half a person": ("a.ndjson", TRAJNET.replace('"p": 2', '"p": 2.5'), "line 4: .*a whole number within .* as id"),
    "a word": ("a.txt", ETH + "820 x 1 1\n", "line 5: got 'x'; expected a number"),
    "a column less": ("a.txt", ETH + "820 1 1\n", "line 5: got 3 columns"),
    "negative": ("a.txt", ETH + "820 -1 1 1\n", "line 5: .*ids from 0"),
    "far away": ("a.txt", ETH + "820 1 1e9 1\n", "line 5: .*numbers within"),
    "no rate": ("a.txt", PETRACK.replace("16.00 fps", ""), "# framerate: got none"),
    "rate 0": ("a.txt", PETRACK.replace("16.00", "0"), "# framerate: got 0"),
    "decimal comma": ("a.txt", PETRACK.replace("16.00", "16,5"), "# framerate: got 16,5"),
    "negative rate": ("a.txt", PETRACK.replace("16.00", "-16"), "# framerate: got -16"),
    "rates": ("a.txt", "# framerate: 8.00\n" + PETRACK, "# framerate: got 16.00 and 8.00"),
    "NaN": ("a.txt", PETRACK + "3 1 nan 1 1\n", "line 8: .*finite"),
    "twice": ("a.txt", PETRACK + "1 1 2 2 2\n", "line 8: .*each id once in a frame"),
    "KITTI, a word": ("a.txt", KITTI.replace("103.0", "x"), "line 3"),
    "KITTI, no width": ("a.txt", KITTI.replace("133.0", "103.0"), "line 3"),
    "KITTI, NaN": ("a.txt", KITTI.replace("133.0", "nan"), r"line 3: .* finite numbers"),
    "KITTI, far away": ("a.txt", KITTI.replace("133.0", "1e9"), r"line 3: .* numbers within"),
    "KITTI, frame -1": ("a.txt", KITTI.replace("2 5 Person", "-1 5 Person"), "line 5: .* frames from 0"),
    "KITTI, id -1": ("a.txt", KITTI.replace("2 5 Person", "2 -1 Person"), "line 5: .* ids from 0"),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line(tmp_path, case):
    name, text, words = BAD[case]
    with pytest.raises(InputError, match=words) as error:
        opened(tmp_path, name, text).truth  # noqa: B018
    assert str(tmp_path / name) in str(error.value)


UNITS = dict.fromkeys(["X [cm] Y [cm]", "x (cm)", "x_cm y_cm", "x/cm y/cm", "x y, in cm"], 1)
UNITS |= {"x/mm y/mm z/mm": 0.1, "x_ft y_ft": 30.48}


@pytest.mark.parametrize(("words", "factor"), (UNITS | {"x/m y/m; heights in cm, max_x_cm: 9": 100}).items())
def test_comments_state_the_unit(tmp_path, words, factor):
    """Heights and limits in centimetres are no positions in centimetres."""
    truth = opened(tmp_path, "hall.txt", PETRACK.replace("x/cm y/cm z/cm", words)).truth
    assert truth.pos == pytest.approx(factor * np.array([p[2:] for p in PLACES]))


@pytest.mark.parametrize("words", ["16, x/cm", "16.", '"16"', "16\n# framerate: 16.00"])
def test_a_rate_is_read_as_it_is_written(tmp_path, words):
    assert opened(tmp_path, "hall.txt", PETRACK.replace("16.00 fps", words)).fps == 16


OPTIONS = [
    ("walk.ndjson", TRAJNET, {"px_per_m": 20}, "got --px-per-m; expected none for a text of trajectories"),
    ("0012.txt", KITTI, {"person_class": 1}, "--class"),
]


@pytest.mark.parametrize(("name", "text", "options", "words"), OPTIONS)
def test_options_without_effect_are_refused(tmp_path, name, text, options, words):
    with pytest.raises(InputError, match=words):
        opened(tmp_path, name, text, **options)


WALK = [(k, p, 0.2 * k, float(p)) for k in range(1, 41) for p in (1, 2, 3)]
BOXES = "".join(f"{k},{p},{40 * x:.1f},{40 * y:.1f},20,68,1,1,1\n" for k, p, x, y in WALK)
PAIR = {1: 5, 2: 5, 3: -1}


def pairs(truth) -> set[tuple[int, int]]:
    return set(zip(truth.id.tolist(), truth.group.tolist(), strict=True))


def test_a_column_of_groups(tmp_path):
    text = "frame,id,x_m,y_m,group\n" + "".join(f"{k},{p},{x},{y},{PAIR[p]}\n" for k, p, x, y in WALK)
    truth = opened(tmp_path, "walk.csv", text, fps=5).truth
    assert pairs(truth) == set(PAIR.items())
    assert truth.labelled.all()
    assert all(some.id.tolist() == [5] and some.members[0].tolist() == [1, 2] for some in truth.groups)
    with pytest.warns(UserWarning, match="labels are 5 frames apart or more; people come and go"):
        opened(tmp_path, "apart.csv", re.sub(r"^(\d+)", lambda k: f"{5 * int(k[1])}", text, flags=re.M), fps=5).truth  # noqa: B018
    with pytest.raises(InputError, match=r"line 2: .*groups from 0, or -1 for alone"):
        opened(tmp_path, "wrong.csv", text.replace("0.2,1.0,5", "0.2,1.0,-2", 1), fps=5).truth  # noqa: B018


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_file_of_group_labels(tmp_path):
    """groups.txt beside gt.txt, NAME.groups.txt beside NAME.txt: one group a line, as in BIWI."""
    mot_folder(tmp_path / "mot", BOXES)
    (tmp_path / "mot" / "gt" / "groups.txt").write_text("1 2\n3\n")
    (tmp_path / "walk.groups.txt").write_text("1, 2\n")
    for truth in (open_source(tmp_path / "mot", fps=5)[0].truth, opened(tmp_path, "walk.txt", BOXES, fps=5).truth):
        assert pairs(truth) == {(1, 1), (2, 1), (3, -1)}
        assert truth.groups is None
        assert all(some.members[0].tolist() == [1, 2] for some in truth.groups_px)
    (tmp_path / "walk.groups.txt").write_text("1 9\n8 7\n")
    with pytest.warns(UserWarning, match="no two people of this recording are in one of its groups"):
        assert pairs(open_source(tmp_path / "walk.txt", fps=5)[0].truth) == {(1, 1), (2, -1), (3, -1)}
    (tmp_path / "walk.groups.txt").write_text("1 two\n")
    with pytest.raises(InputError, match=r"walk\.groups\.txt: line 1: got 1 two; expected ids of people"):
        open_source(tmp_path / "walk.txt", fps=5)[0].truth  # noqa: B018


def steps(step):
    """Two people who walk at 1.2 m/s, 10 rows each, at 10 per s."""
    return "".join(f"{step * k}\t{id}\t{0.12 * k:.2f}\t{id}.0\n" for k in range(10) for id in (1, 2))


def test_steps_of_other_videos_need_a_rate(tmp_path):
    """Frames 0, 1, 2, … at 10 per s are no labels at 2.5 per s; in steps of 10 they may be."""
    (tmp_path / "walk.txt").write_text(steps(1))
    with pytest.raises(InputError, match=r"got frames in steps of 1; .*give --fps, rows of a person per second"):
        open_source(tmp_path / "walk.txt")
    truth = open_source(tmp_path / "walk.txt", fps=10)[0].truth
    assert np.hypot(*truth.vel.T) == pytest.approx(1.2)
    (tmp_path / "walk.txt").write_text(steps(10))
    with pytest.warns(UserWarning, match=r"taken at 2\.5 fps"):
        open_source(tmp_path / "walk.txt")


TRACK = '{{"track": {{"f": {0}, "p": {1}, "x": {2:.1f}, "y": {1}}}}}\n'
SCENE = '{{"scene": {{"id": {0}, "p": 1, "s": {1}, "e": {2}, "fps": 2.5}}}}\n'


@pytest.mark.parametrize("kind", ["ndjson", "txt"])
def test_scenes_that_overlap_are_read_once(tmp_path, kind):
    """Snippets of 6 frames, each 3 later; then scenes with frames and ids of their own, which are apart in files."""

    def scene(number, first, shift=0.0):
        head, row = (SCENE, TRACK) if kind == "ndjson" else ("", "{0} {1} {2:.1f} {1}\n")
        body = [row.format(10 * k, id, k / 10 + shift) for k in range(first, first + 6) for id in (1, 2)]
        return head.format(number, 10 * first, 10 * first + 50) + "".join(body)

    path = tmp_path / f"walk.{kind}"
    path.write_text(scene(0, 0) + scene(1, 3))
    with pytest.warns(UserWarning, match="6 rows stand there twice"):
        truth = open_source(path, fps=2.5)[0].truth
    assert truth.frame.tolist() == [k + 1 for k in range(9) for _ in range(2)]
    assert truth.pos[:, 0] == pytest.approx((truth.frame - 1) / 10)
    path.write_text(scene(0, 0) + scene(1, 0, shift=50))
    with pytest.raises(InputError, match="write each into a file of its own"):
        open_source(path, fps=2.5)
    for number, shift in enumerate((0, 50)):
        path.write_text(scene(number, 0, shift))
        assert len(open_source(path, fps=2.5)[0].truth.frame) == 12
