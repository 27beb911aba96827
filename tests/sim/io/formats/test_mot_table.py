import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.source import open_source


def opened(tmp_path, text):
    (tmp_path / "a.csv").write_text(text)
    return open_source(tmp_path / "a.csv", fps=25)[0]


BOXES = {
    "frame,id,x,y,w,h": "{f},7,10,20,30,40",
    "Frame,ID,Left,Top,Width,Height": "{f},7,10,20,30,40",
    "id,frame,x1,y1,x2,y2": "7,{f},10,20,40,60",
    "frame,id,cx,cy,w,h": "{f},7,25,40,30,40",
    "# hall 3, May\n\nframe,id,x,y,w,h": "{f},7,10,20,30,40\n# a pause",
    "# hall 3, May\n# frame_idx;tracker_id;x_min;y_min;x_max;y_max\n# px": "{f};7;10;20;40;60",
}


@pytest.mark.parametrize("header", BOXES)
def test_named_boxes(tmp_path, header):
    truth = opened(tmp_path, header + "\n" + "".join(BOXES[header].format(f=f) + "\n" for f in (1, 2))).truth
    assert truth.id.tolist() == [7, 7]
    assert truth.frame.tolist() == [1, 2]
    assert truth.box.tolist() == [[10, 20, 30, 40]] * 2


@pytest.mark.parametrize("names", ["x_{0},y_{0}", "X [{0}],Y [{0}]", "x/{0},y/{0}"])
@pytest.mark.parametrize(("unit", "factor"), [("m", 1), ("cm", 100), ("mm", 1000)])
def test_units_of_positions(tmp_path, unit, factor, names):
    rows = f"1,1,{0.5 * factor},{factor}\n2,1,{0.6 * factor},{factor}\n"
    truth = opened(tmp_path, f"frame,id,{names.format(unit)}\n{rows}").truth
    assert truth.pos == pytest.approx(np.array([[0.5, 1], [0.6, 1]]))


@pytest.mark.parametrize(("name", "second"), [("t", 1), ("timestamp_ms", 1000)])
def test_times_in_place_of_frames(tmp_path, name, second):
    """The first is frame 1. The rate is that of the usual step of a person, here 1 s, or given."""
    rows = [f"{(1.7e9 + t + p / 8) * second:.3f},{p},{t / 10},2" for p in (0, 1) for t in (0, 1, 2, 3, 9)]
    (tmp_path / "a.csv").write_text("\n".join([f"{name},agent_id,pos_x,pos_y", *rows]))
    for fps, expected in ((None, [1, 1, 2, 2, 3, 3, 4, 4, 10, 10]), (2, [1, 1, 3, 3, 5, 5, 7, 7, 19, 19])):
        (s,) = open_source(tmp_path / "a.csv", fps=fps)
        assert (s.fps, s.truth.frame.tolist()) == (fps or 1, expected)
    (tmp_path / "a.csv").write_text("t,id,x,y\n400,1,0,0\n800,1,0.1,0\n")
    with pytest.raises(InputError, match=r"times: got 0\.0025 per second; expected 0.1 to 300"):
        open_source(tmp_path / "a.csv")


WARNED = {
    "frame,id,x,y,place,mood\n1,1,0.5,1,hall,\n2,1,0.6,1,hall,3\n": "line 1: columns that are not used: place, mood",
    "frame,id,x,y,group\n1,1,0.5,1,0\n2,1,0.6,1,0\n": "no two people of a frame are in one group",
    # as PeTrack writes them: id first, frames from 0, positions in cm
    "id frame x_cm y_cm z\n1 0 50 100 170\n1 1 60 100 170\n": "frames are counted from 0; they are read as frames",
}


@pytest.mark.filterwarnings("always")
@pytest.mark.parametrize("text", WARNED)
def test_what_is_read_otherwise_than_it_is_written_is_warned_of(tmp_path, text):
    with pytest.warns(UserWarning, match=WARNED[text]):
        truth = opened(tmp_path, text).truth
    assert truth.frame.tolist() == [1, 2]
    assert truth.pos.tolist() == [[0.5, 1], [0.6, 1]]


PLACES = [
    (0.04, 0.04, "all are within 1 m"), (0, 0.3, "all have the same x"), (0.1, 0.1, r"their median speed is 3\.54 m/s"),
]  # fmt: skip


@pytest.mark.parametrize(("x", "y", "words"), PLACES)
def test_places_that_are_hardly_metres_on_the_ground_are_warned_of(tmp_path, x, y, words):
    rows = [f"{f},{k},{x * (5 * k + f)},{y * (5 * k - f)}\n" for f in range(1, 5) for k in range(1, 6)]
    with pytest.warns(UserWarning, match=words):
        opened(tmp_path, "frame,id,x,y\n" + "".join(rows)).truth  # noqa: B018


def test_people_who_run_are_warned_of_where_some_have_no_place(tmp_path):
    places = {True: "-1,-1,-1", False: "{},{},0"}
    rows = [(f, k, places[(f + k) % 7 == 0].format(f / 2, k)) for f in range(1, 30) for k in range(1, 6)]
    with pytest.warns(UserWarning, match=r"their median speed is 12\.5 m/s"):
        opened(tmp_path, "".join(f"{f},{k},{9 * k + f},50,20,60,1,{place}\n" for f, k, place in rows)).truth  # noqa: B018


def test_one_group_of_all_is_warned_of(tmp_path):
    with pytest.warns(UserWarning, match="all are one group"):
        opened(tmp_path, "frame,id,x,y,group\n1,1,0.5,1,0\n1,2,0.6,1,0\n").truth  # noqa: B018


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("header", "row"), [(",frame,id,x,y,w,h", "0,{row}"), ("frame,id,x,y,w,h,", "{row},")])
def test_columns_without_a_name_are_not_used(tmp_path, header, row):
    """As pandas writes the index of a table, or as of lines that end with a comma."""
    truth = opened(tmp_path, f"{header}\n{row.format(row='1,7,10,20,30,40')}\n").truth
    assert truth.box.tolist() == [[10, 20, 30, 40]]


UNCLEAR = {
    "1;7;10,5;20,5;30,5;40,5\n": "line 1: got '10,5'; expected a number as cell 3; write decimals with a point",
    "1\t7\t10,5\t20,5\t30,5\t40,5\n": "line 1: .* write decimals with a point",
    "<html>\n": "line 1: got columns html",
    "frame,id,u,v,w,h\n1,1,2,3,4,5\n": "line 1: got columns frame,id,u,v,w,h; expected frame ",
    "frame,id,x,y\n0.4,1,2,3\n0.8,1,2,3\n": "line 2: got .*time × frames per second",
    "frame,frame_id,x,y,w,h\n1,1,2,3,4,5\n": "line 1: got columns frame,frame_id,x,y,w,h; expected frame ",
    "1,1,0.1,1,1\n2,1,0.2,1,1\n": "line 1: .*4, 6, 7, 8, 9, 10 columns.*name the columns in the first line",
    "# x y of people\n1 1 20 30 170\n": "line 2: .*name the columns in the first line",
    "1,1,3\n": "4, 6, 7, 8, 9, 10 columns",
    "t,id,x,y\n0,1,0,0\n1,1,0,0\n1e30,1,0,0\n": "line 4: .*frames from 1 to 1000000",
    "frame,id,x,y,w,h\n": "no row",
    "\n": "no row",
    "1,9007199254740993,10,20,30,40\n": "a whole number within 4503599627370496 as id",
    "frame,id,x,y,mood\n1,1,2,3\n2,1,2,3\n": "line 2: got 1,1,2,3 .*; expected 5 columns",
    "frame,id,x,y,mood\n1,1,2,3,a\n2,1,2,3\n": "line 3: got 4 columns; expected 5 columns",
    "frame,id,x,y,mood\n1,1,2,3,a\n2,1,here,3,b\n": "line 3: got 'here'; expected a number",
}


@pytest.mark.parametrize("text", UNCLEAR)
def test_what_is_wrong_with_a_text_is_said(tmp_path, text):
    with pytest.raises(InputError, match=UNCLEAR[text]):
        opened(tmp_path, text)


def test_named_boxes_without_ids_are_detections(tmp_path):
    (frame,) = opened(tmp_path, "frame,x,y,w,h,score\n1,10,20,30,40,0.5\n")
    assert frame.detections.box.tolist() == [[10, 20, 30, 40]]
    assert frame.detections.score.tolist() == [0.5]


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(("unit", "pos"), [("_m", [[0.5, 2], [0.6, 2]]), ("", None)])
def test_a_box_and_a_position_with_its_unit(tmp_path, unit, pos):
    """Without a unit in the name, x and y may be anything, so that they are not used."""
    rows = "1,1,0.5,2,100,50,20,40\n2,1,0.6,2,104,50,20,40\n"
    truth = opened(tmp_path, f"frame,id,x{unit},y{unit},left,top,width,height\n{rows}").truth
    assert truth.box.tolist() == [[100, 50, 20, 40], [104, 50, 20, 40]]
    assert (None if truth.pos is None else truth.pos.tolist()) == pos
