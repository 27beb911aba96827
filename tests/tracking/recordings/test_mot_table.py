import numpy as np
import pytest

from scenarios.errors import InputError
from tracking.app.stored_tracks import find_tracks
from tracking.grouping.known_people import people_as_tracks
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_track_text


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
    rows = [f"{(1.7e9 + t + p / 8) * second:.3f},{p},{t / 10},{2 + p}" for p in (0, 1) for t in (0, 1, 2, 3, 9)]
    (tmp_path / "a.csv").write_text("\n".join([f"{name},agent_id,pos_x,pos_y", *rows]))
    for fps, expected in ((None, [1, 1, 2, 2, 3, 3, 4, 4, 10, 10]), (2, [1, 1, 3, 3, 5, 5, 7, 7, 19, 19])):
        (s,) = open_source(tmp_path / "a.csv", fps=fps)
        assert (s.fps, s.truth.frame.tolist()) == (fps or 1, expected)
    (tmp_path / "a.csv").write_text("t_s,id,x,y\n400,1,0,0\n800,1,0.1,0\n")
    with pytest.raises(InputError, match=r"times: got 0\.0025 per second; expected 0.1 to 300"):
        open_source(tmp_path / "a.csv")


WALK = [(k, id, 1 + 0.1 * k, 2 + id) for k in range(20) for id in (7, 8)]  # frame - 1, id, x, y: 10 per s
BEGIN = 1588765432.1  # s since 1970
EPOCHS = {unit: f"{{:.{digits}f}}" for unit, digits in (("s", 3), ("ms", 0), ("us", 0), ("ns", 0))}
PER_S = {"s": 1, "ms": 1000, "us": 1_000_000, "ns": 1_000_000_000}


def walk(header, time):
    return header + "\n" + "".join(f"{time(k)},{id},{x:.2f},{y}\n" for k, id, x, y in WALK)


@pytest.mark.parametrize("begin", [0, BEGIN])
@pytest.mark.parametrize("name", ["timestamp", "t", "Time [{}]"])
@pytest.mark.parametrize("unit", EPOCHS)
@pytest.mark.filterwarnings("ignore:.*are taken as")
def test_times_in_any_unit(tmp_path, unit, name, begin):
    """By the unit of the name, else by the step: 20 frames at 10 per s, in which two people walk at 1 m/s."""

    def time(k):
        return EPOCHS[unit].format((begin + k / 10) * PER_S[unit])

    (tmp_path / "a.csv").write_text(walk(f"{name.format(unit)},id,x,y", time))
    (found,) = open_source(tmp_path / "a.csv")
    assert (found.fps, found.length) == (10, 20)
    assert found.truth.frame.tolist() == [k + 1 for k, *_ in WALK]
    assert np.hypot(*found.truth.vel.T) == pytest.approx(1)


def test_the_unit_of_times_is_said(tmp_path):
    (tmp_path / "a.csv").write_text(walk("t,id,x,y", lambda k: 100 * k))
    with pytest.warns(UserWarning, match=r"column t: times in steps of 100 are taken as ms \(the name t_ms says so\)"):
        open_source(tmp_path / "a.csv")


def test_times_that_fit_two_units_need_a_name_with_it(tmp_path):
    (tmp_path / "a.csv").write_text(walk("t,id,x,y", lambda k: 10 * k))
    with pytest.raises(InputError, match=r"steps of 10, s or ms; .*name the column by its unit, t_s, t_ms, t_us, t_ns"):
        open_source(tmp_path / "a.csv")
    for name, fps in (("t_s", 0.1), ("t_ms", 100)):
        (tmp_path / "a.csv").write_text(walk(f"{name},id,x,y", lambda k: 10 * k))
        assert open_source(tmp_path / "a.csv")[0].fps == fps


@pytest.mark.parametrize(
    ("first", "second"),
    [("2024-05-01T12:00:00.{}00000Z", 0), ("2024-05-01 12:00:00.{}", 0), ("2024-05-01T12:00:{:02d}+02:00", 1)],
)
def test_times_as_iso_8601(tmp_path, first, second):
    """10 per s, or 1 per s where the seconds change."""
    rows = [row for row in WALK if row[0] < 10]
    text = "".join(f"{first.format(k)},{id},{x:.2f},{y}\n" for k, id, x, y in rows)
    (tmp_path / "a.csv").write_text("time,id,x,y\n" + text)
    (found,) = open_source(tmp_path / "a.csv")
    assert (found.fps, found.truth.frame.tolist()) == (1 if second else 10, [k + 1 for k, *_ in rows])


def test_zones_of_times_count(tmp_path):
    times = ("2024-05-01T12:00:00+00:00", "2024-05-01T14:00:01+02:00", "2024-05-01T12:00:02Z")
    (tmp_path / "a.csv").write_text("time,id,x,y\n" + "".join(f"{t},1,{k},0\n" for k, t in enumerate(times)))
    assert open_source(tmp_path / "a.csv")[0].truth.frame.tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("words", "ids"), [(("ped1", "ped12"), [1, 12]), (("Anna", "Bert"), [1, 2]), (("a1", "b1"), [1, 2])]
)
def test_ids_in_words_are_numbered_and_said(tmp_path, words, ids):
    (tmp_path / "a.csv").write_text("t;id;x;y\n" + "".join(f"{k};{w};{k};0\n" for k in (1, 2) for w in words))
    with pytest.warns(UserWarning, match=f"ids in words are numbered: {words[0]} as {ids[0]}, {words[1]} as {ids[1]}"):
        (found,) = open_source(tmp_path / "a.csv")
    assert found.truth.id.tolist() == ids * 2
    assert found.source["ids"] == dict(zip(ids, words, strict=True))


@pytest.mark.parametrize("name", ["type", "agent_type", "Object_Class", "OBJECT_TYPE"])
@pytest.mark.filterwarnings("ignore:.*rows of class car")
def test_classes_in_words_by_the_names_of_others(tmp_path, name):
    """As of INTERACTION and Argoverse: a car beside pedestrians is nobody."""
    rows = "".join(f"{k + 1},{id},{x},{y},{'Car' if id == 8 else 'Pedestrian'}\n" for k, id, x, y in WALK)
    assert set(opened(tmp_path, f"frame,id,x,y,{name}\n{rows}").truth.id) == {7}


@pytest.mark.filterwarnings("ignore:.*not used. t")
def test_times_that_jump_over_a_frame_name_the_remedy(tmp_path):
    """10 times per s, of which the second is late by 0.6 of a frame; all rows are kept when they are numbered."""
    rows = [(k, id, f"{k / 10 + 0.06 * (k == 1):.2f},{id},{x:.1f},{y}") for k, id, x, y in WALK]
    (tmp_path / "a.csv").write_text("t,id,x,y\n" + "\n".join(row for *_, row in rows))
    with pytest.raises(InputError, match=r"line 6: got a second time of id 7 in frame 3; .*number the times in order"):
        open_source(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_text("frame,t,id,x,y\n" + "\n".join(f"{k + 1},{row}" for k, _, row in rows))
    assert len(open_source(tmp_path / "a.csv", fps=10)[0].truth.id) == len(WALK)


@pytest.mark.parametrize("nothing", ["", "None", "null", "NA"])
@pytest.mark.parametrize(("what", "row"), [("id", "2,{},3,0,Aa"), ("group", "2,Bert,3,0,{}")])
@pytest.mark.filterwarnings("ignore:.*(in words are numbered|no two people)")
def test_words_for_nothing_are_no_ids_and_no_groups(tmp_path, nothing, what, row):
    text = "t,id,x,y,group\n1,Anna,0,0,Aa\n2,Anna,0,0,Aa\n" + row
    (tmp_path / "a.csv").write_text(text.format(nothing))
    with pytest.raises(InputError, match=f"line 4: got no {what}; .*-1 for none"):
        open_source(tmp_path / "a.csv")
    (tmp_path / "a.csv").write_text(text.format("-1"))
    assert open_source(tmp_path / "a.csv")[0].length == 2


@pytest.mark.filterwarnings("ignore:.*(in words are numbered|not used)")
def test_rows_of_nobody_are_left_out_and_counted(tmp_path):
    """SUMO's xml2csv writes a row for each vehicle, too, in columns of its own."""
    people = [f"{k / 10};ped{id};{x:.2f};{y};walker;;;" for k, id, x, y in WALK]
    cars = [f"{k / 10};;;;;car7;{30 - k};4.5" for k in range(20)]
    names = "timestep_time;person_id;person_x;person_y;person_type;vehicle_id;vehicle_x;vehicle_y"
    (tmp_path / "a.csv").write_text("\n".join([names, cars[0], *people, *cars[1:]]))
    with pytest.warns(UserWarning, match="a.csv: 20 rows have nobody in columns person_id, person_x, person_y"):
        (found,) = open_source(tmp_path / "a.csv")
    assert found.truth.pos == pytest.approx(np.array([w[2:] for w in WALK]))
    assert (found.truth.id.tolist(), found.fps) == ([7, 8] * 20, 10)
    (tmp_path / "a.csv").write_text("\n".join([names, *people, "0.7;ped9;;;;;;"]))
    with pytest.raises(InputError, match="line 42: got ''; expected a number as cell 3"):
        open_source(tmp_path / "a.csv")


def test_groups_in_words_are_numbered(tmp_path):
    rows = "".join(
        f"{f},{p},{f / 50 + p},{p},{g}\n" for f in (1, 2) for p, g in enumerate(("family", "family", "-1", "A", "A"))
    )
    with pytest.warns(UserWarning, match="groups in words are numbered: family as 1, A as 2"):
        truth = opened(tmp_path, "frame,id,x,y,group\n" + rows).truth
    assert truth.group.tolist() == [1, 1, -1, 2, 2] * 2


@pytest.mark.filterwarnings("ignore:.*columns that are not used. width, length")
@pytest.mark.parametrize("names", ["x,y", "xCenter,yCenter", "cx,cy"])
def test_a_position_beside_a_lone_width(tmp_path, names):
    """As in inD: the centre in m, with width and length of a body."""
    (tmp_path / "a.csv").write_text(f"frame,trackId,{names},width,length\n0,1,0.5,1,0.4,0.3\n1,1,0.6,1,0.4,0.3\n")
    with pytest.warns(UserWarning, match="counted from 0"):
        truth = open_source(tmp_path / "a.csv", fps=25)[0].truth
    assert truth.pos.tolist() == [[0.5, 1], [0.6, 1]]
    assert truth.box is None


def test_a_second_position_is_named_and_corners_are_read(tmp_path):
    with pytest.warns(UserWarning, match="columns that are not used: x2, y2"):
        truth = opened(tmp_path, "frame,id,x,y,x2,y2\n1,1,0.5,1,0.6,1.1\n2,1,0.6,1,0.7,1.1\n").truth
    assert truth.pos.tolist() == [[0.5, 1], [0.6, 1]]
    truth = opened(tmp_path, "frame,id,x,y,x2,y2\n1,1,10,20,40,60\n2,1,11,20,41,60\n").truth
    assert truth.box.tolist() == [[10, 20, 30, 40], [11, 20, 30, 40]]


LOST = "frame,id,x1,y1,x2,y2,lost\n1,1,10,20,40,60,0\n2,1,10,20,40,60,1\n3,1,12,20,42,60,0\n"
STANFORD = '4 10 20 40 60 {} 0 0 1 "Pedestrian"\n4 11 20 41 60 {} 1 0 1 "Pedestrian"\n5 11 20 41 60 {} 0 0 1 "Biker"\n'


@pytest.mark.filterwarnings("ignore:.*(frames are counted|not used. occluded|rows of class biker)")
def test_lost_people_are_no_observations(tmp_path):
    with pytest.warns(UserWarning, match="1 of 3 rows are lost people"):
        assert opened(tmp_path, LOST).truth.frame.tolist() == [1, 3]
    with pytest.warns(UserWarning, match="3 of 9 rows are lost people"):  # of Stanford Drone, without names
        truth = opened(tmp_path, "".join(STANFORD.format(k, k, k) for k in range(3))).truth
    assert truth.id.tolist() == [4, 4, 4]
    assert truth.box[0].tolist() == [10, 20, 30, 40]


def test_classes_beside_positions_count(tmp_path):
    text = "frame,id,x,y,type\n1,1,0.5,1,car\n1,2,0.6,1,pedestrian\n".replace("type", "class")
    with pytest.warns(UserWarning, match="1 rows of class car are left out"):
        assert opened(tmp_path, text).truth.id.tolist() == [2]


CATEGORIES = "".join(f"{f},{id},{10 * id + f},20,30,60,{{{id}}}\n" for f in range(1, 11) for id in range(3))


def test_categories_are_no_confidence(tmp_path):
    (tmp_path / "a.csv").write_text(CATEGORIES.format(0, 2, 0))
    with pytest.raises(InputError, match=r"column 7: got 0, 2, as classes have.*frame,id,left,top,width,height,class"):
        open_source(tmp_path / "a.csv", fps=25)[0].truth  # noqa: B018
    (tmp_path / "a.csv").write_text("frame,id,left,top,width,height,class\n" + CATEGORIES.format(0, 2, 0))
    (found,) = open_source(tmp_path / "a.csv", fps=25, person_class=0)
    assert set(found.truth.id.tolist()) == {0, 2}
    (tmp_path / "a.csv").write_text("frame,id,left,top,width,height,score\n" + CATEGORIES.format(0, 2, 0))
    assert len(open_source(tmp_path / "a.csv", fps=25)[0].truth.id) == 30
    (tmp_path / "a.csv").write_text(CATEGORIES.format(1, 1, 1))
    assert len(open_source(tmp_path / "a.csv", fps=25)[0].truth.id) == 30


@pytest.mark.filterwarnings("ignore:.*counted from 0")
def test_people_in_pixels_without_boxes_need_a_scale(tmp_path):
    """As TrackMate, SLEAP and DeepLabCut find them; with it they are metres."""
    (tmp_path / "a.csv").write_text("frame_idx,track,x [px],y [px]\n0,1,50,100\n1,1,60,100\n")
    with pytest.raises(InputError, match=r"got pixels, without a scale.*add --px-per-m"):
        open_source(tmp_path / "a.csv", fps=25)
    (found,) = open_source(tmp_path / "a.csv", fps=25, px_per_m=40)
    assert found.truth.pos.tolist() == [[1.25, 2.5], [1.5, 2.5]]


@pytest.mark.parametrize("names", [None, "frame,id,left,top,width,height"])
def test_mostly_empty_frames_are_warned_of(tmp_path, names):
    """One row far away, or times as frames; the remedy, a column t, reads these."""
    rows = "".join(f"{f},1,{10 + f},20,30,60\n" for f in range(1, 21))
    text = rows + "1000000,1,10,20,30,60\n" if names is None else f"{names}\n" + rows.replace(",1,", "000,1,")
    with pytest.warns(
        UserWarning, match=r"people are in 2\d of \d+ frames, the last in line 21: .*name their column t"
    ):
        opened(tmp_path, text)
    (tmp_path / "a.csv").write_text("t_ms,id,left,top,width,height\n" + rows.replace(",1,", "00,1,"))
    assert (open_source(tmp_path / "a.csv")[0].fps, open_source(tmp_path / "a.csv")[0].length) == (10, 20)


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


@pytest.mark.parametrize(("unit", "metres"), [("km", 1000), ("degrees", 111_000), ("shares", 20)])
def test_bodies_inside_each_other_are_warned_of(tmp_path, unit, metres):
    """Two people walk 1 m apart: no two bodies come nearer than 0.15 m. With the unit named all is right."""
    rows = "".join(f"{k + 1},{id},{x / metres:.9f},{y / metres:.9f}\n" for k, id, x, y in WALK)
    with pytest.warns(UserWarning, match=f"half are within {1 / metres:.2g} m of another: write metres"):
        opened(tmp_path, f"frame,id,x,y\n{rows}").truth  # noqa: B018
    if unit == "km":
        truth = opened(tmp_path, f"frame,id,x_km,y_km\n{rows}").truth
        assert truth.pos == pytest.approx(np.array([w[2:] for w in WALK]), abs=1e-5)


def test_far_positions_are_read_after_an_offset(tmp_path):
    rows = "frame,id,x,y\n" + "".join(f"{k + 1},{id},{x + 641e3},{{}}\n" for k, id, x, y in WALK)
    with pytest.raises(InputError, match=r"subtract one position near the people from all, if .*UTM"):
        opened(tmp_path, rows.format(*(y + 5471e3 for *_, y in WALK)))
    assert opened(tmp_path, rows.format(*(y for *_, y in WALK))).truth.pos[0, 1] == WALK[0][3]


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
    "0 1 Pedestrian 0 0 -1 10 20 40 90 0 0 0\n": "line 1: got 'Pedestrian'; .*name the columns in the first line",
    "1;7;10,5;20,5;30,5;40,5\n": "line 1: got '10,5'; expected a number as cell 3; write decimals with a point",
    "1\t7\t10,5\t20,5\t30,5\t40,5\n": "line 1: .* write decimals with a point",
    "<html>\n": "line 1: got columns html",
    "frame,id,u,v,w,h\n1,1,2,3,4,5\n": "line 1: got columns frame,id,u,v,w,h; expected a row per person and frame",
    "frame,id,x,y\n0.4,1,2,3\n0.8,1,2,3\n": "line 2: got .*name their column t",
    "frame,frame_id,x,y,w,h\n1,1,2,3,4,5\n": "frame and frame_id mean the same: give one of them another name",
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


@pytest.mark.filterwarnings("ignore:.*people are in 2 of 5000 frames")
def test_empty_frames_of_a_sparse_text_share_their_arrays(tmp_path):
    """Of labels and of tracks: memory by rows, not by the greatest frame."""
    (tmp_path / "a.csv").write_text("1,7,0,0\n5000,7,1,0\n")
    labels = people_as_tracks(open_source(tmp_path / "a.csv", fps=25)[0].truth)
    for found in (labels, read_track_text(tmp_path / "a.csv", 25, None)):
        assert [t.index for t in found if len(t.id)] == [1, 5000]
        assert [t.t for t in found] == pytest.approx(np.arange(5000) / 25)
        assert len({id(getattr(t, name)) for t in found[1:-1] for name in ("id", "pos", "vel", "cov")}) == 4


@pytest.mark.parametrize("frame", [1588765432123, 10**9])
def test_times_as_frames_are_refused_with_the_name_that_reads_them(tmp_path, frame):
    rows = [f"{frame + 100 * k},1,{10 + k},20,30,60,1\n" for k in range(21)]
    with pytest.raises(InputError, match=r"frames from 1 to 1000000; .*name the column t in the first line, if it has"):
        opened(tmp_path, "".join(rows))
    with pytest.warns(UserWarning, match="are taken as ms"):
        found = opened(tmp_path, "t,id,left,top,width,height,score\n" + "".join(rows))
    assert found.length == 51  # 2 s at the 25 fps that are given


@pytest.mark.filterwarnings("ignore:.*are taken as")
@pytest.mark.parametrize(("begin", "unit"), [(BEGIN, 1000), (BEGIN, 1), (0, 1)])
def test_times_of_tracks_count_from_the_first_of_the_labels(tmp_path, begin, unit):
    """The tracks begin in frame 3; of a source without times they count from 0."""

    def time(k):
        return round((begin + k / 10) * unit, 3)

    (tmp_path / "a.csv").write_text(walk("timestamp,id,x,y", time))
    tracks = [line for k, line in enumerate(walk("timestamp,id,x,y", time).splitlines(True)) if k == 0 or k > 4]
    (tmp_path / "b.csv").write_text("".join(tracks))
    (sequence,) = open_source(tmp_path / "a.csv")
    (stored,) = find_tracks(tmp_path / "b.csv")
    found = stored.read(sequence)
    assert [t.index for t in found if len(t.id)] == list(range(3, 21))
    truth = [truth_at.pos.tolist() for truth_at in map(sequence.truth.at, range(3, 21))]
    assert [t.pos.tolist() for t in found if len(t.id)] == truth
    if begin:
        with pytest.raises(InputError, match=r"times: got 15887654.*give seconds since the first frame"):
            read_track_text(tmp_path / "b.csv", 10, 20)
    else:
        assert [t.index for t in read_track_text(tmp_path / "b.csv", 10, 20) if len(t.id)] == list(range(3, 21))
