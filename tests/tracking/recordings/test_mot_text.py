import numpy as np
import pytest

from scenarios.errors import InputError
from sim.truth.velocities import chords, differentiate
from tests.recordings import mot_folder
from tracking.recordings import mot_text
from tracking.recordings.mot_table import read_table
from tracking.recordings.mot_text import unit_scores
from tracking.recordings.source import open_source

DRAWN = {
    "margins": np.random.default_rng(1).gamma(3, 9, 900) + 3,
    "logits": np.random.default_rng(2).normal(1, 2, 900),
    "percent": np.random.default_rng(3).uniform(20, 100, 900),
}


@pytest.mark.parametrize("kind", DRAWN)
@pytest.mark.parametrize("outlier", [400, -1e5, 1e6])
def test_an_outlier_moves_no_other_score(kind, outlier):
    score = DRAWN[kind]
    mapped, told = unit_scores(score)
    again, _ = unit_scores(np.append(score, outlier))
    assert np.abs(again[:-1] - mapped).max() < 0.02
    assert 0 <= mapped.min() < mapped.max() <= 1
    assert (np.diff(mapped[np.argsort(score)]) >= 0).all()
    assert 0.7 < np.mean(mapped >= 0.5) < 0.8
    assert "mapped into 0 to 1 by" in told


def test_the_map_is_said(tmp_path):
    path = tmp_path / "det.txt"
    path.write_text("".join(f"{k},-1,5,5,10,20,{10 * k}\n" for k in range(1, 9)))
    with pytest.warns(UserWarning, match="scores from 10 to 80 are mapped"):
        (sequence,) = open_source(path, fps=25)
    assert [f.detections.score[0] >= 0.5 for f in sequence] == [False] * 2 + [True] * 6


INI = "name=x\nframeRate=10\nseqLength=3\nimWidth=64\nimHeight=48\n"


def test_pets_is_read_with_its_ground_positions(shared_data):
    (s,) = open_source(shared_data / "mot" / "PETS09-S2L1-first200")
    assert (s.name, s.fps, s.length, s.image_size) == ("PETS09-S2L1-first200", 7.0, 200, (480, 360))
    assert s.has_images
    assert s.has_detections
    frames = list(s.without_pictures())
    assert [f.index for f in frames] == list(range(1, 201))
    assert all(f.image is None for f in frames)
    assert sum(len(f.detections.box) for f in frames) == 1132
    assert frames[0].detections.box[0].tolist() == [405.90, 144.69, 27.76, 53.83]
    assert frames[7].t == 1.0
    t = s.truth
    assert t.pos[0].tolist() == [-4.1554, -7.3591]
    assert len(t.frame) == 1122, "101 of 1223 rows have flag 0"
    assert t.groups is None
    assert not t.labelled.any()
    speed = np.linalg.norm(t.vel, axis=1)
    assert 0.8 < np.median(speed) < 1.6, "people walk"


def test_nine_columns_are_flag_class_visibility(tmp_path):
    rows = "1,1,0,0,5,5,1,1,0.25\n1,2,0,0,5,5,0,1,1\n1,3,0,0,5,5,0,7,1\n2,1,1,0,5,5,1,1,-1\n"
    (s,) = open_source(mot_folder(tmp_path, rows, ini=INI))
    assert s.truth.id.tolist() == [1, 1]
    assert s.truth.visibility.tolist() == [0.25, 1.0]
    assert s.truth.pos is None
    assert s.truth.length == 3


def test_ten_columns_are_confidence_and_ground(tmp_path):
    (s,) = open_source(mot_folder(tmp_path, "1,1,0,0,5,5,1,2.5,3.5,0\n2,1,0,0,5,5,1,-1,-1,-1\n", ini=INI))
    assert s.truth.pos[0].tolist() == [2.5, 3.5]
    assert np.isnan(s.truth.pos[1]).all()


def test_detections_with_points_are_on_the_ground(tmp_path):
    (s,) = open_source(mot_folder(tmp_path, det="1,-1,0,0,4,6,0.5,2,3,0\n3,-1,0,0,4,6,0.7,2,4,0\n", ini=INI))
    first, empty, last = (f.detections for f in s)
    assert first.plane == last.plane == "ground"
    assert last.pos.tolist() == [[2, 4]]
    assert len(empty.pos) == 0
    assert s.truth is None


GOOD = "1,1,0,0,5,5,1,1,1\n"


BAD_ROWS = [
    (GOOD + "2,1,0,0,nan,5,1,1,1\n", 2, "finite"), (GOOD + "\n2,1,0,0,5,0,1,1,1\n", 3, "above 0"),
    (GOOD + "1,1,0,0,5,5,1,1,1\n", 2, "once"), (GOOD + "4,1,0,0,5,5,1,1,1\n", 2, "1 to 3"),
    (GOOD + "0,1,0,0,5,5,1,1,1\n", 2, "1 to 3.* add 1 to all frames, if"), (GOOD + "1.5,1,0,0,5,5,1,1,1\n", 2, "whole"),
    ("0,1,0,0,5,5,1,1,1\n5,1,0,0,5,5,1,1,1\n", 1, "number its frames 1, 2, 3, .* 0, 10, 20"),
    (GOOD + "2,1,0,0,5,x,1,1,1\n", 2, "'x'"), (GOOD + "2,1,0,0,5\n", 2, "9 columns"),
    (GOOD + "2,1,0,0,5,5,1,1,1.5\n", 2, "visibility"), ("1,2,3\n", 1, "columns"),
    (GOOD + "1,2,1e200,0,5,5,1,1,1\n", 2, "within 1e"), (GOOD + "1,1.5,0,0,5,5,1,1,1\n", 2, "whole number"),
    (GOOD + "1,1_0,0,0,5,5,1,1,1\n", 2, "'1_0'"), (GOOD + "1,²,0,0,5,5,1,1,1\n", 2, "'²'"),
    ("time,id,x,y\n1,1,2,3\n", 1, "got columns time,id,x,y; .*time of frame 1. × frames per second"),
]  # fmt: skip


@pytest.mark.parametrize(("gt", "line", "word"), BAD_ROWS)
def test_bad_rows_are_one_line(tmp_path, gt, line, word):
    with pytest.raises(InputError, match=word) as error:
        open_source(mot_folder(tmp_path, gt, ini=INI))[0].truth  # noqa: B018
    assert error.value.place == f"line {line}"
    assert error.value.file.endswith("gt.txt")
    assert error.value.exit_code == 2


def test_a_bare_text_is_truth_or_detections(tmp_path):
    (tmp_path / "a.txt").write_text("1,3,0,0,4,6,1,-1,-1,-1\n")
    (tmp_path / "b.txt").write_text("1,-1,0,0,4,6,1,-1,-1,-1\n")
    (a,), (b,) = open_source(tmp_path / "a.txt", fps=10), open_source(tmp_path / "b.txt", fps=10)
    assert a.truth.id.tolist() == [3]
    assert not a.has_detections
    assert b.truth is None
    assert next(iter(b)).detections.box.tolist() == [[0, 0, 4, 6]]


@pytest.mark.parametrize("seed", range(5))
def test_velocity_of_straight_walks_is_exact_in_any_row_order(seed):
    r = np.random.default_rng(seed)
    frame = np.concatenate([np.flatnonzero(r.random(30) < 0.7) + 1 for _ in range(4)])
    id = np.repeat(np.arange(4), [len(frame) // 4 + (k < len(frame) % 4) for k in range(4)])
    frame, id = np.unique(np.stack([frame, id]), axis=1)
    start, v = r.normal(size=(4, 2)), r.normal(size=(4, 2))
    pos = start[id] + v[id] * frame[:, None] / 10
    mixed = r.permutation(len(frame))
    vel = differentiate(frame[mixed], id[mixed], pos[mixed], 10.0)
    alone = (vel == 0).all(axis=1)
    np.testing.assert_allclose(vel[~alone], v[id[mixed]][~alone], atol=1e-9)
    near = np.array([((np.abs(frame - f) <= 2) & (id == i)).sum() > 1 for f, i in zip(frame, id, strict=True)])[mixed]
    assert np.array_equal(alone, ~near)
    assert differentiate(frame[:0], id[:0], pos[:0], 10.0).shape == (0, 2)


def test_nothing_says_how_long_it_is(tmp_path):
    with pytest.raises(InputError, match="tells its length"):
        open_source(mot_folder(tmp_path, det="", ini="frameRate=10\n"))
    (s,) = open_source(mot_folder(tmp_path, det="", ini="frameRate=10\nseqLength=3\n"))
    assert [len(f.detections.pos) for f in s] == [0, 0, 0]


def test_too_many_lines_of_a_frame(tmp_path):
    path = tmp_path / "gt.txt"
    path.write_text("".join(f"1,{k},10,10,20,50\n" for k in range(5001)))
    with pytest.raises(InputError, match="5000 lines of one frame"):
        read_table(path)


def test_people_without_boxes(tmp_path):
    """Trajectories on the ground, as a text of one's own."""
    path = tmp_path / "walk.txt"
    path.write_text("1,1,-1,-1,-1,-1,1,3,4,0\n2,1,-1,-1,-1,-1,1,3.5,4,0\n2,2,10,10,20,50,1,6,4,0\n")
    truth = mot_text.truth_of_table(read_table(path), "x", 2.0)
    assert truth.box is None
    assert np.isnan(truth.px_per_m)
    assert truth.pos.tolist() == [[3, 4], [3.5, 4], [6, 4]]
    path.write_text("1,1,-1,-1,-1,-1,1,3,4,0\n1,2,10,10,20,50,1,-1,-1,-1\n")
    with pytest.raises(InputError, match="a box, or x, y, z in every line") as error:
        mot_text.truth_of_table(read_table(path), "x", 2.0)
    assert error.value.place == "line 1"


def test_ground_positions_alone(tmp_path):
    """The shortest text of trajectories: frame, id, x, y."""
    path = tmp_path / "walk.csv"
    path.write_text("1 1 3 4\n2 1 3.5 -1\n2 2 -1 -1\n")
    truth = mot_text.truth_of_table(read_table(path), "x", 2.0)
    assert truth.box is None
    assert truth.pos.tolist() == [[3, 4], [3.5, -1], [-1, -1]]
    assert truth.z.tolist() == [0, 0, 0]


def test_a_row_that_does_not_count_hides_no_duplicate(tmp_path):
    """The neighbours of the sorted table are not enough: a row of flag 0 may lie between two rows of one id."""
    path = tmp_path / "gt.txt"
    path.write_text("1,1,10,10,20,50,1,1,1\n1,1,11,10,20,50,0,1,1\n1,1,12,10,20,50,1,1,1\n")
    with pytest.raises(InputError, match="each id once") as error:
        mot_text.truth_of_table(read_table(path), "x", 10.0)
    assert error.value.place == "line 3"


SEQINFOS = [
    ("seqLength", "9999999"), ("seqLength", "4.5"), ("seqLength", "²"), ("frameRate", "1e9"),
    ("seqLength", "-3"), ("frameRate", "fast"), ("frameRate", "0"), ("frameRate", "nan"),
    ("frameRate", "0.001"), ("imWidth", "60000"), ("imHeight", "480.5"), ("imWidth", "-1"),
    ("frameRate", "1_0"), ("frameRate", "\u0661\u0660"),
]  # fmt: skip


@pytest.mark.parametrize(("key", "value"), SEQINFOS)
def test_seqinfo(tmp_path, key, value):
    given = {"frameRate": "10", "seqLength": "4", "imWidth": "64", "imHeight": "48"} | {key: value}
    (tmp_path / "seqinfo.ini").write_text("[Sequence]\n" + "".join(f"{k}={v}\n" for k, v in given.items()))
    with pytest.raises(InputError) as error:
        open_source(tmp_path)
    assert error.value.place == key


def test_another_section_of_seqinfo_is_an_error(tmp_path):
    (tmp_path / "seqinfo.ini").write_text("[sequence]\nframeRate=10\n")
    with pytest.raises(InputError, match=r"got \[sequence\]; expected \[Sequence\]"):
        open_source(tmp_path)


def test_chords_look_back_only():
    frame, id = np.array([0, 1, 2, 5, 0]), np.array([7, 7, 7, 7, 3])
    pos = np.array([[0.0, 0], [1, 0], [2, 0], [5, 5], [0, 0]])
    want = np.array([[np.nan] * 2, [10, 0], [10, 0], [np.nan] * 2, [np.nan] * 2])
    np.testing.assert_allclose(chords(frame, id, pos, 10.0, 0.2), want)
    mixed = np.array([3, 1, 4, 0, 2])
    np.testing.assert_allclose(chords(frame[mixed], id[mixed], pos[mixed], 10.0, 0.2), want[mixed])
    assert chords(frame[:0], id[:0], pos[:0], 10.0).shape == (0, 2)


def test_copied_names_of_sequences_are_said_and_the_folders_names_count(tmp_path):
    for name in ("cam1", "cam2"):
        mot_folder(tmp_path / name, ini="name=MOT17-02\nframeRate=30\nseqLength=3\n", det="")
    with pytest.warns(UserWarning, match="MOT17-02 is the name of 2 sequences"):
        assert [s.name for s in open_source(tmp_path)] == ["cam1", "cam2"]


def test_an_outlier_among_shares_is_clipped():
    score = np.random.default_rng(4).uniform(0.5, 1, 400)
    mapped, told = unit_scores(np.append(score, 400.0))
    assert mapped.tolist() == [*score.tolist(), 1.0]
    assert told == "1 of 401 scores outside 0 to 1 are clipped"
