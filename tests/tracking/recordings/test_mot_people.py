import numpy as np
import pytest

from scenarios.errors import InputError
from tests.recordings import mot_folder
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_checked_tracks, read_tracks

BOX = "10,10,20,50"


def rows(tails, frames=3):
    """Rows of `frames` frames; person k has the columns tails[k] from the seventh on."""
    cells = ((f, k, tail) for f in range(1, frames + 1) for k, tail in enumerate(tails, 1))
    return "".join(f"{f},{k},{10 * k + f},10,20,50,{tail}\n" for f, k, tail in cells)


def labels(tmp_path, tails):
    return mot_folder(tmp_path / "S", rows(tails))


def text(tmp_path, tails):
    (tmp_path / "res.txt").write_text(rows(tails))
    return tmp_path / "res.txt"


@pytest.mark.parametrize("tails", [["1,2,1", "1,1,1", "1,2,1"], ["1,2,1,-1", "1,1,1,-1", "1,2,1,-1"]])
def test_classes_left_out_are_counted_and_can_be_named(tmp_path, tails):
    folder = labels(tmp_path, tails)
    with pytest.warns(UserWarning, match="6 rows of class 2 are left out; people are class 1"):
        assert set(open_source(folder, fps=25)[0].truth.id) == {2}
    assert set(open_source(folder, fps=25, person_class=2)[0].truth.id) == {1, 3}


@pytest.mark.filterwarnings("ignore:.*not taken as metres")
def test_several_classes_may_be_people(tmp_path):
    tails = ["1,1,0,0", "1,2,0,0", "1,4,0,0"]  # VisDrone's: pedestrian, people, car
    path = text(tmp_path, tails)
    assert set(open_source(path, fps=25, person_class="1,2")[0].truth.id) == {1, 2}
    assert {k for t in read_checked_tracks(path, fps=25, person_class=("1", "2")) for k in t.id.tolist()} == {1, 2}
    with pytest.raises(InputError, match="--class: got '1,,2'; expected classes apart by commas"):
        open_source(path, fps=25, person_class="1,,2")


WORDS = {
    "class": ("class", ["Person", "bicycle", "pedestrian"]),
    "quoted": ("category", ['"person"', '"traffic light"', '"person"']),
    "label": ("label", ["person", "car", "person"]),
    "header apart by blanks": ("class", ["person", "car", "person"]),
    "name beside a number": ("class,name", ["0,person", "7,car", "0,person"]),
}


def words(tmp_path, kind):
    names, cells = WORDS[kind]
    lines = [f"{f},{k},{10 * k + f},10,20,50,{cell}" for f in (1, 2) for k, cell in enumerate(cells, 1)]
    header = f"frame,id,left,top,width,height,{names}".replace(",", " " if "blanks" in kind else ",")
    (tmp_path / "people.csv").write_text("\n".join([header, *lines]))
    return tmp_path / "people.csv"


@pytest.mark.filterwarnings("ignore:.*columns that are not used")
@pytest.mark.parametrize("kind", WORDS)
def test_classes_in_words(tmp_path, kind):
    path, other = words(tmp_path, kind), WORDS[kind][1][1].split(",")[-1].strip('"')
    with pytest.warns(UserWarning, match=f"2 rows of class {other} are left out; people are class person or pedestr"):
        assert set(open_source(path, fps=25)[0].truth.id) == {1, 3}
    assert set(open_source(path, fps=25, person_class=other.title())[0].truth.id) == {2}
    with pytest.raises(InputError, match=f"2 rows of class {other}.*expected people, of class 1"):
        _ = open_source(path, fps=25, person_class=1)[0].truth


def test_names_of_people_are_no_classes(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text(f"frame,id,left,top,width,height,name\n1,1,{BOX},Ann\n1,2,{BOX},Bob\n")
    with pytest.warns(UserWarning, match="columns that are not used: name"):
        assert len(open_source(path, fps=25)[0].truth.id) == 2


@pytest.mark.parametrize("wrong", [0, 2])
def test_a_class_that_leaves_nobody_is_an_error_that_counts(tmp_path, wrong):
    folder = labels(tmp_path, [f"1,{wrong},1"] * 2)
    with pytest.raises(InputError, match=rf"got 6 rows of class {wrong}.*--class"):
        _ = open_source(folder, fps=25)[0].truth
    assert len(open_source(folder, fps=25, person_class=wrong)[0].truth.id) == 6


def test_confidences_that_are_all_zero_leave_nobody_out(tmp_path):
    assert len(open_source(text(tmp_path, ["0", "0"]), fps=25)[0].truth.id) == 6


def test_labels_that_are_all_to_be_ignored_are_an_error(tmp_path):
    with pytest.raises(InputError, match=r"column 7.*0 in all 6 rows"):
        _ = open_source(labels(tmp_path, ["0,1,1"] * 2), fps=25)[0].truth


@pytest.mark.parametrize("more", ["", ",-1"])
def test_tracks_of_other_classes_are_left_out_with_a_warning(tmp_path, more):
    path = text(tmp_path, ["0.9,1,-1" + more, "0.9,3,-1" + more])
    with pytest.warns(UserWarning, match="3 rows of class 3 are left out"):
        found = read_tracks(path, fps=25)
    assert np.concatenate([t.id for t in found]).tolist() == [1, 1, 1]


def test_detections_have_classes_too(tmp_path):
    path = tmp_path / "det.txt"
    path.write_text(f"1,-1,{BOX},0.9,0,-1\n1,-1,{BOX},0.9,2,-1\n")
    with pytest.raises(InputError, match="1 rows of class 0, 1 rows of class 2"):
        open_source(path, fps=25)
    (frame,) = open_source(path, fps=25, person_class=0)[0]
    assert len(frame.detections.box) == 1


def placed(tmp_path, place, people=3, frames=12, name="res.txt"):
    """A text whose boxes move by 10 px a frame; place(frame, person) gives columns 8 to 10."""
    cells = (
        (f, k, ",".join(f"{v:g}" for v in place(f, k))) for f in range(1, frames + 1) for k in range(1, people + 1)
    )
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).write_text("".join(f"{f},{k},{100 * k + 10 * f},50,20,50,1,{p}\n" for f, k, p in cells))
    return tmp_path / name


NOT_METRES = {
    "class, occlusion": (lambda f, k: (1, (f + k) % 2, 0), "same position"),
    "a category of each": (lambda f, k: (k, 0, 0), "few whole numbers"),
    "flags that change": (lambda f, k: (k, f % 2, 0), "few whole numbers"),
    "shares of each": (lambda f, k: (0.1 * k, 0.5, 0), "same while the boxes move"),
    "pixels": (lambda f, k: (100 * k + 10 * f + 0.5, 50.5, 0), "inside their own boxes"),
    "jumps": (lambda f, k: (50.5 * ((f + k) % 4), 7.5, 0), "longer than 12 m"),
}


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("kind", NOT_METRES)
def test_columns_that_cannot_be_metres(tmp_path, kind):
    place, why = NOT_METRES[kind]
    path = placed(tmp_path, place)
    with pytest.warns(UserWarning, match=f"not taken as metres: .*{why}"):
        assert open_source(path, fps=25)[0].truth.pos is None
    with pytest.warns(UserWarning, match="not taken as metres"):
        found = read_tracks(path, fps=25)
    assert found[0].plane == "image"


PLACES = [
    (1, lambda f, k: (0, 0, 0), None),  # zeros are unknown
    (3, lambda f, k: (0, 0, 0), None),
    (3, lambda f, k: (k + (0.05 * f if k > 1 else 0), 2.25, 0), (1, 2.25)),  # people who walk or stand
]


@pytest.mark.parametrize(("people", "place", "first"), PLACES)
def test_zeros_are_unknown_and_people_who_walk_or_stand_are_in_metres(tmp_path, people, place, first):
    path = placed(tmp_path, place, people)
    pos = open_source(path, fps=25)[0].truth.pos
    assert (None if pos is None else tuple(pos[0])) == first
    assert read_tracks(path, fps=25)[0].plane == ("image" if first is None else "ground")


def test_a_camera_file_beside_it_vouches_for_metres(tmp_path):
    path = placed(tmp_path, lambda f, k: (k, 0, 0), name="S/gt/gt.txt")
    (tmp_path / "S" / "camera.json").write_text("{}")
    assert open_source(path, fps=25)[0].truth.pos[0].tolist() == [1, 0]


def visdrone(tmp_path, category):
    """frame,id,left,top,w,h,score,category,truncation,occlusion"""
    return placed(tmp_path, lambda f, k: (category(k), 0, (f + k) % 3), people=5)


@pytest.mark.filterwarnings("always")
def test_categories_of_people_and_cars(tmp_path):
    path = visdrone(tmp_path, lambda k: 4 if k > 2 else 1)
    with pytest.warns(UserWarning, match="36 rows of class 4 are left out; people are class 1"):
        truth = open_source(path, fps=25)[0].truth
    assert set(truth.id) == {1, 2}
    with pytest.warns(UserWarning, match="36 rows of class 4 are left out"):
        assert {k for t in read_tracks(path, fps=25) for k in t.id.tolist()} == {1, 2}
    assert set(open_source(path, fps=25, person_class=4)[0].truth.id) == {3, 4, 5}


@pytest.mark.parametrize("unit", [1, 100, 1000])
@pytest.mark.parametrize("header", ["", "frame,id,x,y\n"])
def test_positions_alone_are_in_metres_or_refused(tmp_path, unit, header):
    path = tmp_path / "walk.csv"
    rows = [f"{f},{k},{unit * (k + 1.3 * f / 25):g},{unit * k}" for f in range(1, 12) for k in (1, 2)]
    path.write_text(header + "\n".join(rows))
    if unit == 1:
        assert open_source(path, fps=25)[0].truth.pos.max() < 3
        return
    for read in (lambda: open_source(path, fps=25)[0].truth, lambda: read_tracks(path, fps=25)):
        with pytest.raises(InputError, match=r"half of the steps faster than 1.*m/s; expected positions"):
            read()


def test_positions_that_err_are_in_metres(tmp_path):
    # errors of 0.5 m at 30 frames/s: 27 m/s from frame to frame, 3 m/s over 0.5 s
    path, rng = tmp_path / "walk.csv", np.random.default_rng(0)
    pos = np.arange(90)[:, None, None] * [1.3 / 30, 0.0] + [[0.0, 0.0], [0.0, 1.0]] + rng.normal(0, 0.5, (90, 2, 2))
    rows = [f"{f + 1},{k + 1},{x:.3f},{y:.3f}" for f, both in enumerate(pos) for k, (x, y) in enumerate(both)]
    path.write_text("\n".join(rows))
    assert len(open_source(path, fps=30)[0].truth.id) == 180


def test_labels_without_ids_are_an_error(tmp_path):
    mot_folder(tmp_path, f"1,-1,{BOX},1,1,1\n")
    with pytest.raises(InputError, match="negative ids in all 1 rows"):
        _ = open_source(tmp_path, fps=25)[0].truth
