"""Tidy tables and texts of trajectories: what they hold agrees with the run or truth; units stand in the names."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from scenarios.errors import InputError
from sim.types import GroupEvent, Groups, Tracks
from tests.made_up import make_sequence
from tracking.export.tidy_tables import run_tables, truth_tables, write_tables
from tracking.recordings.source import open_source

NAMES = ["counts", "crossings", "events", "groups", "members", "people", "people_summary"]


def frame(index: int, people: dict[int, tuple[float, float, int]], *events: GroupEvent, plane="ground") -> Tracks:
    """One frame at 2 frames/s of people who walk at (0.6, 0.8) m/s: id: (x, y, group)."""
    id, group = np.array(list(people), np.int64), np.array([g for *_, g in people.values()], np.int64)
    n, pos = len(id), np.array([(x, y) for x, y, _ in people.values()], np.float64).reshape(-1, 2)
    names = np.unique(group[group >= 0])
    members = tuple(id[group == g] for g in names)
    two, k = np.zeros((len(names), 2)), len(names)
    groups = Groups(names, members, two, two, np.zeros((k, 2, 2)), np.array([float(len(m)) for m in members]), ())
    vel = np.tile([0.6, 0.8], (n, 1))
    t, cov = (index - 1) / 2, np.zeros((n, 4, 4))
    return Tracks(index, t, plane, "person", id, group, pos, vel, cov, None, np.ones(n), groups, events)


MERGE = GroupEvent("merge", 2, 3, 3, (-1, -1), (7,), (1, 2), (1.0, float("nan")))


def walk() -> list[Tracks]:
    """Persons 1 and 2 are group 7 in frames 2, 3 and 5; 3 is alone, and stands, from 60 s on."""
    pairs = {1: -1, 2: 7, 3: 7, 4: -1, 5: 7}
    some = [frame(k, {1: (k, 0, g), 2: (k, 1, g)}, *([MERGE] if k == 3 else [])) for k, g in pairs.items()]
    late = [frame(k, {}) for k in range(6, 121)]
    last = frame(121, {3: (9, 9, -1)})
    return [*some, *late, last.replace(vel=np.zeros((1, 2)))]


def rows(table) -> list[dict]:
    return table.to_arrow().to_pylist()


def test_people_have_sub_groups_where_the_truth_has():
    truth = make_sequence(0).truth
    assert "subgroup" not in truth_tables(truth).people.columns
    numbers = np.arange(len(truth.id))
    assert truth_tables(truth.replace(subgroup=numbers)).people.columns["subgroup"].tolist() == numbers.tolist()


def test_people_have_si_units():
    people = rows(run_tables(walk(), 2.0).people)
    assert people[2] == {
        "frame": 2, "t_s": 0.5, "id": 1, "x_m": 2.0, "y_m": 0.0, "speed_m_s": pytest.approx(1.0),
        "heading_rad": pytest.approx(np.arctan2(0.8, 0.6)), "score": 1.0, "group": 7,
    }  # fmt: skip
    assert (people[-1]["speed_m_s"], people[-1]["heading_rad"]) == (0.0, None), "who stands has no direction"


def test_what_is_in_the_image_is_in_px():
    tables = run_tables([frame(1, {1: (3, 4, -1)}, plane="image")], 2.0)
    assert {"x_px", "y_px", "speed_px_s"} <= set(rows(tables.people)[0])
    assert {"path_px", "speed_mean_px_s"} <= set(rows(tables.people_summary)[0])


def test_people_of_a_truth_have_their_visibility():
    """Only if there are boxes, of which they are shares."""
    truth = make_sequence(1).truth
    people = truth_tables(truth).people.columns
    assert people["visibility"].tolist() == truth.visibility.tolist()
    assert people["truncation"].tolist() == truth.truncation.tolist()
    plain = truth_tables(truth.replace(box=None, truncation=None)).people.columns
    assert {"visibility", "truncation"}.isdisjoint(plain)
    assert {"visibility", "truncation"}.isdisjoint(run_tables(walk(), 2.0).people.columns)


def test_people_summary():
    one, _, last = rows(run_tables(walk(), 2.0).people_summary)
    assert one == {
        "id": 1, "start_frame": 1, "end_frame": 5, "t_start_s": 0.0, "t_end_s": 2.0, "frames": 5, "path_m": 4.0,
        "speed_mean_m_s": pytest.approx(1.0), "groups": [7],
    }  # fmt: skip
    assert (last["t_start_s"], last["path_m"], last["groups"]) == (60.0, 0.0, [])


def test_members_are_intervals_of_frames():
    tables = run_tables(walk(), 2.0)
    found = [(m["group"], m["id"], m["start_frame"], m["end_frame"], m["t_end_s"]) for m in rows(tables.members)]
    assert found == [(7, 1, 2, 3, 1.0), (7, 1, 5, 5, 2.0), (7, 2, 2, 3, 1.0), (7, 2, 5, 5, 2.0)]
    (group,) = rows(tables.groups)
    assert (group["id"], group["start_frame"], group["end_frame"], group["frames"]) == (7, 2, 5, 3)
    assert (group["size_mean"], group["size_max"]) == (2.0, 2.0)


def test_events_and_counts():
    tables = run_tables(walk(), 2.0)
    assert rows(tables.events) == [
        {
            "kind": "merge", "start_frame": 2, "end_frame": 3, "t_start_s": 0.5, "t_end_s": 1.0, "members": [1, 2],
            "before": [-1, -1], "after": [7], "x_m": 1.0, "y_m": None,
        }
    ]  # fmt: skip
    first, second = rows(tables.counts)
    assert (first["people"], first["people_new"], first["groups"], first["events"]) == (2, 2, 1, 1)
    assert first["people_mean"] == pytest.approx(10 / 120)
    assert (second["t_start_s"], second["t_end_s"], second["people"], second["people_mean"]) == (60.0, 60.5, 1, 1.0)


def test_a_run_without_people_has_empty_tables(tmp_path: Path):
    for tracks in ([], [frame(1, {})]):
        tables = run_tables(tracks, 2.0)
        assert [len(table.to_arrow()) for name, table in tables.named().items() if name != "counts"] == [0] * 6
        write_tables(tables, tmp_path, "csv", {})
        assert sorted(p.stem for p in tmp_path.iterdir()) == NAMES
        assert (tmp_path / "people.csv").read_text().startswith("frame,t_s,id,x_m,y_m,")


def test_whole_groups_are_no_people():
    track = frame(1, {4: (1, 1, 4)})
    groups = track.groups.replace(members=(), size=np.array([np.nan]))
    tables = run_tables([replace(track, unit="group", groups=groups)], 2.0)
    assert rows(tables.people) == rows(tables.members) == []
    (group,) = rows(tables.groups)
    assert (group["id"], group["frames"], group["size_mean"]) == (4, 1, None)


def test_csv_and_parquet_hold_the_same(tmp_path: Path):
    tables = run_tables(walk(), 2.0)
    write_tables(tables, tmp_path, "csv", {})
    write_tables(tables, tmp_path, "parquet", {"fps": 2.0})
    for name in NAMES:
        stored = pq.read_table(tmp_path / f"{name}.parquet").to_pylist()
        assert stored == rows(getattr(tables, name))
        text = list(csv.DictReader(io.StringIO((tmp_path / f"{name}.csv").read_text())))
        assert [row.keys() for row in text] == [row.keys() for row in stored]
        for cells, values in zip(text, stored, strict=True):
            for key, value in values.items():
                expected = "" if value is None else " ".join(map(str, value)) if isinstance(value, list) else value
                assert expected == (cells[key] if isinstance(expected, str) else float(cells[key])), (name, key)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("k", [0, 1, 2])
def test_people_of_a_truth_are_read_back(tmp_path: Path, k: int):
    truth = make_sequence(k).truth
    write_tables(truth_tables(truth), tmp_path, "csv", {})
    again = open_source(tmp_path / "people.csv", fps=truth.fps)[0].truth
    for name in ("frame", "id", "group", "box"):
        assert np.array_equal(getattr(again, name), getattr(truth, name)), name
    if again.pos is not None:
        assert np.array_equal(again.pos, truth.pos)


def test_a_truth_states_its_groups_and_events():
    truth = make_sequence(0).truth
    tables = truth_tables(truth)
    stated = {
        (k, int(g), int(m))
        for k, some in enumerate(truth.groups, 1)
        for g, who in zip(some.id, some.members, strict=True)
        for m in who
        if truth.labelled[k - 1]
    }
    assert stated
    told = {
        (k, row["group"], row["id"])
        for row in rows(tables.members)
        for k in range(row["start_frame"], row["end_frame"] + 1)
    }
    assert told == stated
    assert sorted(e.start for e in truth.events) == [e["start_frame"] for e in rows(tables.events)]


def test_people_are_counted_in_frames_without_labels_of_groups():
    truth = make_sequence(0).truth
    (minute,) = rows(truth_tables(truth).counts)
    assert not truth.labelled.all()
    assert minute["people_mean"] == pytest.approx(len(truth.id) / len(np.unique(truth.frame)), rel=0.1)
    assert minute["groups_mean"] == pytest.approx(
        np.mean([len(g.id) for g, known in zip(truth.groups, truth.labelled, strict=True) if known])
    )


@pytest.mark.parametrize("form", ["trajnet", "pedpy"])
def test_texts_of_trajectories_are_read_back(tmp_path, form):
    tables = run_tables(walk(), 2.0)
    (path,) = write_tables(tables, tmp_path, form, {"fps": 2.0})
    (back,) = open_source(path)
    people, truth = tables.people.columns, back.truth
    assert back.fps == 2.0
    assert np.array_equal(truth.frame, people["frame"])
    assert np.array_equal(truth.id, people["id"])
    assert np.allclose(truth.pos, np.column_stack([people["x_m"], people["y_m"]]), atol=1e-4)


def test_lines_of_trajectories(tmp_path):
    (path,) = write_tables(run_tables(walk(), 2.0), tmp_path, "trajnet", {"fps": 2.0})
    scene, *_, last = map(json.loads, path.read_text().splitlines())
    assert scene == {"scene": {"id": 0, "p": 1, "s": 1, "e": 5, "fps": 2.0}}
    assert last == {"track": {"f": 121, "p": 3, "x": 9.0, "y": 9.0}}
    (path,) = write_tables(run_tables(walk(), 2.0), tmp_path, "pedpy", {"fps": 2.0})
    assert path.read_text().splitlines()[:3] == ["# framerate: 2", "# id\tframe\tx/m\ty/m", "1\t1\t1.0000\t0.0000"]


def test_trajectories_in_the_image_are_refused(tmp_path):
    with pytest.raises(InputError, match="people in the image"):
        write_tables(run_tables([frame(1, {1: (3, 4, -1)}, plane="image")], 2.0), tmp_path, "pedpy", {"fps": 2.0})
