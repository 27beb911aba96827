import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Camera
from tracking import group
from tracking.recordings import biwi
from tracking.recordings.source import open_source

LOOKS_DOWN = np.array([[1.0, 0, 0], [0, -0.6, -0.8], [0, 0.8, -0.6]])
ROW = "{} {} {} 0 {} 2.5 0 0.0\n"


def biwi_folder(tmp_path, groups="", rows=None):
    rows = [(f, i, f / 10, i) for f in (1, 11, 21, 81) for i in (1, 2, 3)] if rows is None else rows
    (tmp_path / "obsmat.txt").write_text("".join(ROW.format(*row) for row in rows))
    (tmp_path / "groups.txt").write_text(groups)
    return tmp_path


def test_seq_hotel_truth(shared_data):
    (s,) = open_source(shared_data / "biwi" / "seq_hotel")
    t = s.truth
    assert (len(t.frame), len(np.unique(t.id))) == (6544, 390)
    assert t.pos[0].tolist() == [1.3983781, -5.7433032]
    assert t.vel[0].tolist() == [-0.32708274, -1.6802858]
    assert len(np.unique(t.group[t.group >= 0])) == 41
    assert len(t.groups) == 1807
    assert t.labelled.all()
    assert np.unique(t.group[t.id == 14]) == np.unique(t.group[t.id == 15])
    assert all(set(e.members) <= set(t.id.tolist()) for e in t.events)
    labels = set(t.group.tolist())
    assert all(set(e.before) | set(e.after) <= labels for e in t.events)
    check_groups(t, t.groups)


def check_groups(truth, groups):
    """Each frame's groups are the labels of at least two people there, and hulls hold their members."""
    for index, some in enumerate(groups, 1):
        here = truth.rows(index)
        names, counts = np.unique(truth.group[here][truth.group[here] >= 0], return_counts=True)
        assert some.id.tolist() == names[counts > 1].tolist()
        for g, members in zip(some.id, some.members, strict=True):
            assert members.tolist() == truth.id[here][truth.group[here] == g].tolist()


def test_biwi_groups_survive_their_traps(tmp_path):
    folder = biwi_folder(tmp_path, "# pairs\n1 1 2\n3 3\n\n7 8\n")
    assert biwi.read_groups(folder / "groups.txt") == {1: 1, 2: 1, 7: 2, 8: 2}
    folder = biwi_folder(tmp_path, "1 2\n2 3\n")
    with pytest.warns(UserWarning, match="one group"):
        assert biwi.read_groups(folder / "groups.txt") == {1: 1, 2: 1, 3: 1}


def test_biwi_at_a_rate_at_which_people_run_is_warned_of(tmp_path):
    folder = biwi_folder(tmp_path, rows=[(f, i, f / 10, i) for f in range(1, 81, 10) for i in range(4)])
    with pytest.warns(UserWarning, match="their median speed is 10 m/s: check their unit, and the frame rate"):
        open_source(folder, fps=10)[0].truth  # noqa: B018
    open_source(folder, fps=2.5)[0].truth  # noqa: B018


def test_biwi_without_groups_is_not_labelled(tmp_path):
    folder = biwi_folder(tmp_path)
    (folder / "groups.txt").unlink()
    (s,) = open_source(folder)
    assert s.length == 9
    assert s.truth.pos[4].tolist() == [1.1, 2]
    assert s.truth.vel[4].tolist() == [2.5, 0]
    assert not s.truth.labelled.any()
    assert s.truth.groups is None
    assert (s.truth.group == -1).all()


BAD_BIWI = [
    ("1 x\n", None, "line 1: .*ids of people"),
    ("1 1\n2 1\n3 2\n4 2\n5 3\n", None, "two numbers in all 5 lines, with labels in the second place"),
    ("", [(1, 1, 0, 0), (1, 1, 0, 0)], "line 2: .*once"),
    ("", [(1, 1, "nan", 0)], "line 1: .*finite"),
    ("", [(1, 1.5, 0, 0)], "line 1: .*whole"),
    ("", [(1, 1, 1e200, 0)], "line 1: .*within 1e"),
    ("", [(1, -1, 0, 0)], "line 1: .*ids from 0"),
    ("", [(1, 1, 0, 0), (11, 1, 0, 0), (80_000_000, 1, 0, 0)], "frames from 1 to 1000000"),
    ("", [(f, 1, f / 10, 1) for f in (0, 6, 12, 18, 24, 30, 31, 32, 33, 42, 48)], "frames are nearer than a step"),
    ("", [], "no line"),
]


@pytest.mark.parametrize(("groups", "rows", "word"), BAD_BIWI)
def test_bad_biwi_is_one_line(tmp_path, groups, rows, word):
    with pytest.raises(InputError, match=word):
        open_source(biwi_folder(tmp_path, groups, rows))[0].truth  # noqa: B018


DOES = "<hypothesislist><hypothesis><movement>walking</movement></hypothesis></hypothesislist>"
OBJECT = '<object id="{}"><box h="8" w="16" xc="{}" yc="20"/>' + DOES + "</object>"
GROUP = '<group id="{}"><members>{}</members></group>'


def xml(tmp_path, *frames, tag="dataset"):
    body = "".join(
        f'<frame number="{k}"><objectlist>{"".join(o)}</objectlist><grouplist>{"".join(g)}</grouplist></frame>'
        for k, (o, g) in enumerate(frames)
    )
    path = tmp_path / "clip.xml"
    path.write_text(f'<?xml version="1.0" encoding="UTF-8"?><{tag} name="clip">{body}</{tag}>')
    return path


def test_a_calibration_puts_cvml_on_the_ground(tmp_path):
    """Labels of others, as Milan's of PETS 2009: as the same boxes in a MOT text. CAVIAR's own show no feet."""
    camera = Camera("pinhole", (96, 64), (90.0, 90.0), (48.0, 32.0), np.array([0.0, 0, 3]), LOOKS_DOWN)
    box = [(k, id, 20 + k + 9 * id, 5, 10, 33) for k in range(4) for id in (1, 2)]
    row = '<object id="{}"><box h="{}" w="{}" xc="{}" yc="{}"/></object>'
    frames = [([row.format(i, h, w, x + w / 2, y + h / 2) for f, i, x, y, w, h in box if f == k], []) for k in range(4)]
    (tmp_path / "a.txt").write_text("".join(f"{f + 1},{i},{x},{y},{w},{h},1\n" for f, i, x, y, w, h in box))
    found = [open_source(path, fps=5, camera=camera)[0] for path in (xml(tmp_path, *frames), tmp_path / "a.txt")]
    runs = [group(each) for each in found]
    assert [t.plane for t in runs[0]] == ["ground"] * 4
    for cvml, mot in zip(*runs, strict=True):
        assert cvml.pos.tolist() == mot.pos.tolist()
    own = xml(tmp_path, ([OBJECT.format(0, 10)], [GROUP.format(1, "0")]))
    with pytest.raises(InputError, match="got --camera; expected none for a CAVIAR recording"):
        open_source(own, camera=camera)


def test_meet_walk_together_truth(shared_data):
    t = open_source(shared_data / "caviar" / "mwt1gt.xml", fps=25)[0].truth
    assert (t.pos, t.groups, len(t.groups_px)) == (None, None, 707)
    assert t.box[0].tolist() == [18, 205, 14, 8]
    assert sum(len(g.id) for g in t.groups_px) == 182 + 82 + 10
    check_groups(t, t.groups_px)
    told = [(e.kind, e.start, e.end, e.before, e.after, e.members) for e in t.events]
    assert told == [("form", 339, 388, (-1, -1), (0,), (1, 2)), ("leave", 493, 493, (0,), (-1,), (1, 2))], (
        "two people alone form a group, 27 frames after they are labelled as one and 10 after they are within 1.5 m"
    )
    some = next(g for g in t.groups_px if len(g.id))
    assert some.pos[0, 0] > 20, "px"


def test_caviar_traps(tmp_path):
    objects = [OBJECT.format(k, 10 * k) for k in (1, 2, 3)]
    path = xml(tmp_path, (objects, [GROUP.format(4, "1,2"), GROUP.format(5, "3")]), (objects, []))
    truth = open_source(path, fps=25)[0].truth
    assert truth.frame.tolist() == [1, 1, 1, 2, 2, 2]
    assert truth.group.tolist() == [4, 4, -1, -1, -1, -1]
    with pytest.warns(UserWarning, match="two groups"):
        truth = open_source(xml(tmp_path, (objects, [GROUP.format(4, "1,2"), GROUP.format(5, "2,3")])), fps=25)[0].truth
    assert truth.group.tolist() == [4, 4, 5]


CVML = [
    ([OBJECT.format(1, 10).replace(DOES, "")], "no hypotheses"),
    ([OBJECT.format(1, 10), OBJECT.format(2, 700)], "a larger picture"),
    ([], "nobody"),
]


@pytest.mark.parametrize(("objects", "what"), CVML)
def test_cvml_of_others_needs_a_frame_rate(tmp_path, objects, what):
    """Neither CAVIAR's 25 fps nor its 384×288 px are assumed."""
    path = xml(tmp_path, (objects, []))
    with pytest.raises(InputError, match="--fps: got labels without frame rate"):
        open_source(path)
    (s,) = open_source(path, fps=12)
    assert (s.fps, s.image_size) == (12, None), what


def test_xml_of_others_names_the_form_that_is_read(tmp_path):
    """As CVAT, Pascal VOC and SUMO write it."""
    (tmp_path / "a.xml").write_text("<annotations><track><box frame='0'/></track></annotations>")
    with pytest.raises(InputError, match=r"got <annotations>; .* write them as \.csv, and name the columns"):
        open_source(tmp_path / "a.xml", fps=25)


def test_cvml_without_frames_is_refused(tmp_path):
    """Frames stand right below the root: others, deep in an XML of another program, were read as 0 frames."""
    for body in ("", "<part><frame number='0'/></part>", "<a>" * 50 + "</a>" * 50):
        (tmp_path / "clip.xml").write_text(f"<dataset>{body}</dataset>")
        with pytest.raises(InputError, match="no <frame> in <dataset>"):
            open_source(tmp_path / "clip.xml", fps=25)


BAD_CAVIAR = [
    ((([OBJECT.format(1, "nan")], []),), "dataset", "a number"),
    ((([OBJECT.format("a", 1)], []),), "dataset", "a whole number"),
    ((([OBJECT.format("²", 1)], []),), "dataset", "a whole number"),
    ((([OBJECT.format(1, 1), OBJECT.format(2, 5)], [GROUP.format(1, "1,²")]),), "dataset", "ids of people"),
    ((([OBJECT.format(1, "1e200")], []),), "dataset", "to 1000000"),
    ((([OBJECT.format(1, 1).replace('"8"', '"0"')], []),), "dataset", "from 1e-06"),
    ((([OBJECT.format(1, 1)] * 2, []),), "dataset", "once"),
    ((([], [GROUP.format(1, "a,b")]),), "dataset", "ids of people"),
    (((['<object id="1"/>'], []),), "dataset", "without box"),
    (((["<object>"], []),), "dataset", "broken XML"),
    ((([], []),), "Camera", "<dataset>"),
]


@pytest.mark.parametrize(("frames", "tag", "word"), BAD_CAVIAR)
def test_bad_caviar_is_one_line(tmp_path, frames, tag, word):
    with pytest.raises(InputError, match=word):
        open_source(xml(tmp_path, *frames, tag=tag))


STEP = 6


def test_biwi_that_changes_back_to_the_first_grid(tmp_path):
    """The same person at 813 and 816: 816 gets the next slot, as do the frames after it, up to the gap."""
    rows = [(f, 1, f / STEP, 1) for f in (780, 786, 792, 801, 807, 813, 816, 822, 828, 852, 858)]
    (s,) = open_source(biwi_folder(tmp_path, "", rows))
    assert s.truth.frame.tolist() == [1, 2, 3, 5, 6, 7, 8, 9, 10, 13, 14]
    assert np.all(np.abs(s.truth.frame - 1 - (np.array([r[0] for r in rows]) - 780) / STEP) <= 1)


@pytest.mark.parametrize(("step", "rate"), [(20, 1.25), (30, 2.5 / 3), (5, 5), (1, 25)])
def test_biwi_of_other_frames_has_the_rate_of_its_velocities(tmp_path, step, rate):
    brief = [(1, i, i, 0) for i in range(3, 40)]  # in one frame: their velocities tell nothing
    folder = biwi_folder(tmp_path, "", brief + [(f, i, f / 10, i) for f in range(1, 10 * step, step) for i in (1, 2)])
    with pytest.warns(UserWarning, match=f"it has {rate:.4g} frames per second, and not 2.5"):
        assert open_source(folder)[0].truth.fps == pytest.approx(rate)


def test_cvml_of_caviar_says_what_is_assumed(tmp_path):
    path = xml(tmp_path, ([OBJECT.format(1, 10)], []))
    with pytest.warns(UserWarning, match="taken at 25 fps, with pictures of 384×288 px"):
        (s,) = open_source(path)
    assert (s.fps, s.image_size) == (25, (384, 288))
    assert open_source(path, fps=30)[0].fps == 30
