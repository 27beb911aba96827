import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.source import open_source
from sim.io.store.track_files import read_tracks


def text(tmp_path, place, people=3, frames=12, name="res.txt"):
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
    path = text(tmp_path, place)
    with pytest.warns(UserWarning, match=f"not taken as metres: .*{why}"):
        assert open_source(path, fps=25)[0].truth.pos is None
    with pytest.warns(UserWarning, match="not taken as metres"):
        found = read_tracks(path, fps=25)
    assert found[0].plane == "image"


@pytest.mark.parametrize("people", [1, 3])
def test_zeros_are_unknown(tmp_path, people):
    path = text(tmp_path, lambda f, k: (0, 0, 0), people)
    assert open_source(path, fps=25)[0].truth.pos is None
    assert read_tracks(path, fps=25)[0].plane == "image"


def test_people_who_walk_or_stand_are_in_metres(tmp_path):
    path = text(tmp_path, lambda f, k: (k + (0.05 * f if k > 1 else 0), 2.25, 0))
    assert np.allclose(open_source(path, fps=25)[0].truth.pos[0], (1, 2.25))
    assert read_tracks(path, fps=25)[0].plane == "ground"


def test_a_camera_file_beside_it_vouches_for_metres(tmp_path):
    path = text(tmp_path, lambda f, k: (k, 0, 0), name="S/gt/gt.txt")
    (tmp_path / "S" / "camera.json").write_text("{}")
    assert open_source(path, fps=25)[0].truth.pos[0].tolist() == [1, 0]


def visdrone(tmp_path, category):
    """frame,id,left,top,w,h,score,category,truncation,occlusion"""
    return text(tmp_path, lambda f, k: (category(k), 0, (f + k) % 3), people=5)


@pytest.mark.filterwarnings("always")
def test_categories_of_people_and_cars(tmp_path):
    path = visdrone(tmp_path, lambda k: 4 if k > 2 else 1)
    with pytest.warns(UserWarning, match="36 rows of class 4 are left out; people are class 1"):
        truth = open_source(path, fps=25)[0].truth
    assert set(truth.id) == {1, 2}
    with pytest.warns(UserWarning, match="36 rows of class 4 are left out"):
        assert {k for t in read_tracks(path, fps=25) for k in t.id.tolist()} == {1, 2}
    assert set(open_source(path, fps=25, person_class=4)[0].truth.id) == {3, 4, 5}


@pytest.mark.filterwarnings("always")
def test_categories_without_people(tmp_path):
    with pytest.raises(InputError, match="60 rows of class 4; expected people, of class 1"):
        _ = open_source(visdrone(tmp_path, lambda k: 4), fps=25)[0].truth


@pytest.mark.filterwarnings("always")
def test_categories_have_no_distractors(tmp_path):
    """Class 2 of VisDrone is a person who sits, no distractor of MOTChallenge."""
    assert open_source(visdrone(tmp_path, lambda k: 1 + k % 2), fps=25)[0].truth.unscored is None


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("flag", [lambda f, k: (f + k) % 3, lambda f, k: k % 2])
def test_flags_are_no_categories(tmp_path, flag):
    path = text(tmp_path, lambda f, k: (flag(f, k), f % 2, 0), people=5)
    assert set(open_source(path, fps=25)[0].truth.id) == {1, 2, 3, 4, 5}


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
