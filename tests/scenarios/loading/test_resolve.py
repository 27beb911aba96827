"""Files, `extends`, `--set`, strictness and the resolved form."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import scenarios
from scenarios.errors import InputError
from scenarios.loading.resolve import dump, dump_sensor, load, load_observation, names, resolve, sensor_settings
from scenarios.loading.toml_files import CATALOGUE
from scenarios.schema.sensor import BoxNoise, FalseAlarms, Hide, Memory, Sensor


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def error_of(path: Path, *settings: str) -> InputError:
    with pytest.raises(InputError) as caught:
        load(path, settings)
    return caught.value


def test_dump_loads_back_equal_and_twice_the_same(path: Path) -> None:
    scenario = load(path)
    again = load(write(path.with_name("other.toml"), dump(scenario)))
    assert again == scenario
    assert dump(again) == dump(scenario)
    assert again.name == "tour"


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=25, deadline=None)
@example(about='\x7f\x00\t"\\ü€\u2028', turn=1e-300, size=1)
@given(about=st.text(), turn=st.floats(-1e6, 1e6), size=st.integers(1, 400))
def test_dump_holds_any_text_and_number(path: Path, about: str, turn: float, size: int) -> None:
    group = load(path).group[0].model_copy(update={"size": float(size)})
    scenario = load(path).model_copy(update={"about": about, "turn_deg": turn, "group": (group,), "event": ()})
    assert load(write(path.with_name("any.toml"), dump(scenario))) == scenario


def test_every_catalogue_scenario_loads_and_dumps(tmp_path: Path) -> None:
    for name in names():
        scenario = load(name)
        assert scenario.about, name
        assert load(write(tmp_path / "again.toml", dump(scenario))) == scenario


def test_extends_merges_tables_and_rows_by_id(path: Path) -> None:
    child = write(
        path.with_name("child.toml"),
        """
        extends = "tour.toml"
        camera = { fps = 25 }
        world = { pillars = [] }
        group = [{ id = "b", start = [11, { choice = [3, 4] }] }, { id = "e", size = 2, start = [1, 7], goal = [3, 7] }]
        event = [{ id = "q1", when = { after = "s1" } }]
        """,
    )
    base, scenario = load(path), load(child)
    assert scenario.name == "child"
    assert (scenario.camera.fps, scenario.camera.tilt_deg) == (25, base.camera.tilt_deg)
    assert scenario.world.pillars == ()
    assert scenario.world.walls == base.world.walls
    assert [g.id for g in scenario.group] == ["a", "b", "w", "e"]
    assert scenario.group[1].goal == base.group[1].goal
    assert scenario.group[0] == base.group[0]
    assert scenario.event[2].when.time is None
    assert scenario.event[2].when.after == "s1"


def test_extends_chain_and_circle(path: Path) -> None:
    folder = path.parent
    write(folder / "one.toml", 'extends = "tour.toml"\nduration = 40.0')
    write(folder / "two.toml", 'extends = "one.toml"\nwarmup = 1.0')
    assert (load(folder / "two.toml").duration, load(folder / "two.toml").warmup) == (40, 1)
    write(folder / "x.toml", 'extends = "y.toml"')
    write(folder / "y.toml", 'extends = "x.toml"')
    error = error_of(folder / "x.toml")
    assert error.place == "extends"
    assert "x.toml → y.toml → x.toml" in error.got
    write(folder / "z.toml", 'extends = "nowhere.toml"')
    assert "nowhere.toml" in error_of(folder / "z.toml").got


SETTINGS = [
    ("duration=25", lambda s: s.duration == 25.0), ("camera.kind=top", lambda s: s.camera.kind == "top"),
    ("group.a.size=5", lambda s: s.group[0].size == 5), ("group.0.size=5", lambda s: s.group[0].size == 5),
    ("group.w.repeat=4", lambda s: s.group[2].repeat == 4),
    ("group.b.start.1=3.5", lambda s: s.group[1].start == (11, 3.5)),
    ("group.a.size={ uniform = [3, 3] }", lambda s: s.group[0].size.uniform == (3, 3)),
    ("event.s1.parts.d.goal=[7, 8]", lambda s: s.event[1].parts[1].goal == (7, 8)),
    ("event.m1.when.delay=1", lambda s: s.event[0].when.delay == 1),
    ("sensor.box=amodal", lambda s: s.sensor.box == "amodal"), ("warmup=0", lambda s: s.warmup == 0),
    ("group.e={ size = 2, start = [1, 7], goal = [3, 7] }", lambda s: s.group[3].id == "e"),
    ("world.pillars=[]", lambda s: s.world.pillars == ()), ("about=a word", None), ("group.z.size=3", None),
    ("group.7.size=3", None), ("duration.x=3", None), ("duration", None), ("=3", None), ("a..b=3", None),
    ("duration=3\nwarmup=2", None),
]  # fmt: skip


@pytest.mark.parametrize(("setting", "value"), SETTINGS)
def test_set(path: Path, setting: str, value) -> None:  # type: ignore[no-untyped-def]
    if value is None:
        settings = [setting, "event=[]"] if "duration" not in setting else [setting]
        assert "--set" in error_of(path, *settings).place
        return
    settings = [setting, "event.s1.parts=[{ id = 'c', goal = [14, 5] }, { id = 'd', goal = [8, 8] }]"]
    if setting.startswith("event.s1"):
        settings.pop()
    assert value(load(path, settings))


REFUSED = [
    ("sensor.detect_probb=1", "sensor.detect_probb", "unknown key", "known key", "mean detect_prob?"),
    ("group.a.sped=2", "group.a.sped", "unknown key 'sped'", "", "mean speed"),
    ("group.a.size={norml=[1,2]}", "group.a.size", "'norml'", "", "mean normal"),
    ("event.s1.parts.c.sze=2", "parts.c.sze", "'sze'", "", "mean size?"),
    ("event.m1.when.reach={gruop='a'}", "when.reach", "'gruop'", "", "mean group?"),
    ("group.a.size=big", "", "'big'", "a number, or a distribution", ""),
    ("group.a.size=true", "", "true", "a number, or a distribution", ""),
    ("group.a.start=[1, 'x']", "", "'x'", "a number, or a distribution", ""),
    ("group.a.start=[1]", "", "[1]", "at least 2", ""), ("group.a.start=5", "", "5", "a list, see docs", ""),
    ("group.a.size={normal=[1,2], uniform=[1,2]}", "", "uniform", "exactly one of normal", ""),
    ("duration='20'", "", "'20'", "number", ""), ("duration=nan", "", "nan", "finite", ""),
    ("duration=2020-01-01", "", "2020-01-01", "number", ""), ("camera.fps=-1", "", "-1", "from 0.01 to 1000", ""),
    ("event.m1.type=mrge", "", "'mrge'", "'merge'", ""), ("event.m1.goal=mete", "", "'mete'", "'meet'", ""),
    ("event.m1.when={time=1, after='x'}", "", "after", "exactly one of time", ""),
    ("event.m1.groups=['a']", "", "['a']", "at least 2", ""), ("group.a.id='1 2'", "", "'1 2'", "a name", ""),
    ("schema=2", "", "2", "1", ""), ("mirror=3", "", "3", "true or false", ""), ("world=3", "", "3", "a table", ""),
    ("world.size=[1, 2, 3]", "", "[1, 2, 3]", "at most 2", ""), ("camera.tilt_deg=200", "", "200", "equal to 90", ""),
]  # fmt: skip


@pytest.mark.parametrize(("setting", "place", "got", "expected", "remedy"), REFUSED)
def test_strict(path: Path, setting: str, place: str, got: str, expected: str, remedy: str) -> None:
    error = error_of(path, setting)
    assert error.file == str(path)
    assert place in error.place
    assert got in error.got
    assert expected in error.expected
    assert remedy in error.remedy
    assert "more problem" not in error.remedy


def test_syntax_error_has_its_line(tmp_path: Path) -> None:
    error = error_of(write(tmp_path / "bad.toml", "schema = 1\nduration = = 3\n"))
    assert "line 2" in error.place
    (tmp_path / "bytes.toml").write_bytes(b"about = '\xff'")
    assert "UTF-8" in error_of(tmp_path / "bytes.toml").got
    assert "no such file" in error_of(tmp_path / "none.toml").got
    (tmp_path / "folder.toml").mkdir()
    error_of(tmp_path / "folder.toml")


@pytest.mark.parametrize(
    ("read", "words"), [(sensor_settings, "flockscope fit sensor"), (load_observation, "--camera")]
)
def test_missing_files_have_a_remedy(tmp_path: Path, read: Callable[[Path], object], words: str) -> None:
    with pytest.raises(InputError, match=f"none.toml: got No such file.*{words}"):
        read(tmp_path / "none.toml")


def test_a_byte_order_mark_is_no_content(tmp_path: Path) -> None:
    (tmp_path / "mark.toml").write_bytes(b"\xef\xbb\xbf" + (CATALOGUE / "merge.toml").read_bytes())
    assert load(tmp_path / "mark.toml").duration == load("merge").duration


def test_unknown_names_are_answered_with_near_ones() -> None:
    with pytest.raises(InputError, match="expected a scenario"):
        resolve("nothing-like-this")
    with pytest.raises(InputError, match="expected a suite"):
        resolve("suite:nothing-like-this")


MINE = Sensor(
    detect_prob=0.9, by_visibility=(0.0, 0.5, 1.0),
    miss_memory=(Memory(share=0.4, time=0.5), Memory(share=0.2, time=5.0)),
    box_noise=BoxNoise(across=(-0.01, 0.05), memory=(Memory(share=0.3, time=1.0),)), points="foot",
    false_alarms=FalseAlarms(life=1.5, at=((0.2, 0.3), (0.5, 0.9))), true_scores=(0.1, 0.9),
)  # fmt: skip


def test_settings_after_it_win_and_hiding_stays(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(dump_sensor(MINE))
    hide = "sensor.hide=[{ start = 1.0, end = 2.0 }]"
    found = scenarios.load("merge", set=[hide, *sensor_settings(path), "sensor.detect_prob=0.5"]).sensor
    assert found.hide == (Hide(start=1.0, end=2.0),)
    assert found == MINE.model_copy(update={"detect_prob": 0.5, "hide": found.hide})


WRONG = [
    ("", "'sensor'"), ("[sensor]\ndetect_prop = 0.5", "detect_prob"),
    ("[sensor]\ndetect_prob = 1.5", "sensor.detect_prob"), ("[camera]\nfps = 5\n[sensor]\n", "'camera'"),
    ("[sensor]\nnoise_px = 3", "or box_noise"), ("[sensor]\nbox_noise = { acros = [0, 1] }", "mean across"),
    ("[sensor]\nmiss_memory = [{ share = 0.5, time = 1.0 }]\npersistence = 0.5", "miss_memory or persistence"),
    ("[sensor]\nmiss_memory = [{ share = 0.6, time = 1.0 }, { share = 0.6, time = 2.0 }]", "at most 1"),
    ("[sensor]\ntrue_scores = [0.5, 0.4]", "do not decrease"), ("schema = 2\n[sensor]\n", "schema"),
    ("[sensor", "TOML"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words"), WRONG)
def test_what_is_wrong_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        sensor_settings(path)
    assert words in str(error.value)
    assert "bad.toml" in str(error.value)
