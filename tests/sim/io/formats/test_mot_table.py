import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.source import open_source

BOXES = {
    "frame,id,x,y,w,h": "{f},7,10,20,30,40",
    "Frame,ID,Left,Top,Width,Height": "{f},7,10,20,30,40",
    "id,frame,x1,y1,x2,y2": "7,{f},10,20,40,60",
    "frame,id,cx,cy,w,h": "{f},7,25,40,30,40",
}


@pytest.mark.parametrize("header", BOXES)
def test_named_boxes(tmp_path, header):
    path = tmp_path / "a.csv"
    path.write_text(header + "\n" + "".join(BOXES[header].format(f=f) + "\n" for f in (1, 2)))
    truth = open_source(path, fps=25)[0].truth
    assert truth.id.tolist() == [7, 7]
    assert truth.frame.tolist() == [1, 2]
    assert truth.box.tolist() == [[10, 20, 30, 40]] * 2


@pytest.mark.parametrize(("unit", "factor"), [("m", 1), ("cm", 100), ("mm", 1000)])
def test_units_of_positions(tmp_path, unit, factor):
    path = tmp_path / "walk.csv"
    path.write_text(f"frame,id,x_{unit},y_{unit}\n1,1,{0.5 * factor},{factor}\n2,1,{0.6 * factor},{factor}\n")
    assert open_source(path, fps=25)[0].truth.pos == pytest.approx(np.array([[0.5, 1], [0.6, 1]]))


@pytest.mark.filterwarnings("always")
def test_columns_without_a_meaning_are_named(tmp_path):
    path = tmp_path / "five.csv"
    path.write_text("frame,id,x,y,place,mood\n1,1,0.5,1,hall,\n2,1,0.6,1,hall,3\n")
    with pytest.warns(UserWarning, match="line 1: columns that are not used: place, mood"):
        truth = open_source(path, fps=25)[0].truth
    assert truth.pos.tolist() == [[0.5, 1], [0.6, 1]]


@pytest.mark.filterwarnings("always")
def test_frames_from_zero(tmp_path):
    """As PeTrack writes them: id first, frames from 0, positions in cm."""
    path = tmp_path / "petrack.txt"
    path.write_text("id frame x_cm y_cm z\n1 0 50 100 170\n1 1 60 100 170\n")
    with pytest.warns(UserWarning, match="frames are counted from 0; they are read as frames from 1"):
        truth = open_source(path, fps=16)[0].truth
    assert truth.frame.tolist() == [1, 2]
    assert truth.pos.tolist() == [[0.5, 1], [0.6, 1]]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("header", "row"), [(",frame,id,x,y,w,h", "0,{row}"), ("frame,id,x,y,w,h,", "{row},")])
def test_columns_without_a_name_are_not_used(tmp_path, header, row):
    """As pandas writes the index of a table, or as of lines that end with a comma."""
    path = tmp_path / "a.csv"
    path.write_text(f"{header}\n{row.format(row='1,7,10,20,30,40')}\n")
    assert open_source(path, fps=25)[0].truth.box.tolist() == [[10, 20, 30, 40]]


UNCLEAR = {
    "frame;id;x;y;w;h\n1;7;10;20;30;40\n": "line 1: .* apart by commas.* semicolons",
    "1;7;10,5;20,5;30,5;40,5\n": "line 1: .* apart by commas.* decimals with a point",
    "<html>\n": "line 1: got columns <html>",
    "frame,id,u,v\n": "line 1: got columns frame,id,u,v",
    "frame,id,x,y,w,h\n": "no row",
    "1,9007199254740993,10,20,30,40\n": "a whole number within 4503599627370496 as id",
}


@pytest.mark.parametrize("text", UNCLEAR)
def test_what_is_wrong_with_a_text_is_said(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=UNCLEAR[text]):
        open_source(path, fps=25)


def test_named_boxes_without_ids_are_detections(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("frame,x,y,w,h,score\n1,10,20,30,40,0.5\n")
    (frame,) = open_source(path, fps=25)[0]
    assert frame.detections.box.tolist() == [[10, 20, 30, 40]]
    assert frame.detections.score.tolist() == [0.5]


@pytest.mark.parametrize("header", ["frame,id,u,v,w,h", "time,id,x,y,w,h", "frame,frame_id,x,y,w,h"])
def test_other_names_are_refused(tmp_path, header):
    path = tmp_path / "a.csv"
    path.write_text(header + "\n1,1,2,3,4,5\n")
    with pytest.raises(InputError, match=f"line 1: got columns {header}; expected frame "):
        open_source(path, fps=25)


@pytest.mark.parametrize("rate", ["1_0", "\u0661\u0660"])
def test_frame_rates_are_plain_numbers(tmp_path, rate):
    (tmp_path / "seqinfo.ini").write_text(f"[Sequence]\nframeRate={rate}\nseqLength=3\n", encoding="utf-8")
    with pytest.raises(InputError, match="frameRate: got"):
        open_source(tmp_path)


@pytest.mark.parametrize("body", ["1,1,0.1,1,1\n2,1,0.2,1,1\n", "# x y of people\n1 1 20 30 170\n"])
def test_unknown_columns_are_refused_with_the_way_to_name_them(tmp_path, body):
    path = tmp_path / "five.csv"
    path.write_text(body)
    with pytest.raises(InputError, match=r"line 1: .*name the columns in the first line"):
        open_source(path, fps=25)


ROWS = {
    "frame,id,x,y,mood\n1,1,2,3\n2,1,2,3\n": "line 2: got 1,1,2,3 .*; expected 5 columns",
    "frame,id,x,y,mood\n1,1,2,3,a\n2,1,2,3\n": "line 3: got 4 columns; expected 5 columns",
    "frame,id,x,y,mood\n1,1,2,3,a\n2,1,here,3,b\n": "line 3: got 'here'; expected a number",
}


@pytest.mark.parametrize("text", ROWS)
def test_rows_have_the_columns_that_are_named(tmp_path, text):
    (tmp_path / "walk.csv").write_text(text)
    with pytest.raises(InputError, match=ROWS[text]):
        open_source(tmp_path / "walk.csv", fps=5)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_box_and_a_position_with_its_unit(tmp_path):
    """Without a unit in the name, x and y may be anything, so that they are not used."""
    row = "\n1,1,0.5,2,100,50,20,40\n2,1,0.6,2,104,50,20,40\n"
    for unit, known in (("_m", True), ("", False)):
        (tmp_path / "walk.csv").write_text(f"frame,id,x{unit},y{unit},left,top,width,height{row}")
        truth = open_source(tmp_path / "walk.csv", fps=5)[0].truth
        assert truth.box.tolist() == [[100, 50, 20, 40], [104, 50, 20, 40]]
        assert (truth.pos is not None) == known
        assert not known or truth.pos.tolist() == [[0.5, 2], [0.6, 2]]
