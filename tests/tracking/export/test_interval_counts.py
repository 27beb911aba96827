"""Counts per interval: only of observed frames, between start and end, with a margin that fits the positions."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Tracks
from tests.made_up import make_sequence
from tests.tracking.export.test_tidy_tables import frame, rows, walk
from tracking.export.places import parse_places
from tracking.export.tidy_tables import run_tables, truth_tables

FPS = 2.0
PLACES = parse_places(["door=3.5,-1,3.5,5"], ["hall=4.5,-1,20,-1,20,20,4.5,20"])


def way(xs: list[float | None], y: float = 0.0, **more) -> list[Tracks]:
    """Person 1 at each x; None: nobody is in the frame."""
    return [frame(k, {} if x is None else {1: (x, y, -1)}).replace(**more) for k, x in enumerate(xs, 1)]


def crossed(tracks: list[Tracks], **options) -> tuple[int, int]:
    """How often somebody crosses the door to the left and to the right."""
    columns = run_tables(tracks, FPS, {"door": PLACES["door"]}, **options).counts.columns
    return tuple(int(np.sum(columns[f"door_to_{side}"])) for side in ("left", "right"))


def test_counts_have_columns_of_places():
    first, second = rows(run_tables(walk(), FPS, PLACES).counts)
    assert (first["door_to_left"], first["door_to_right"]) == (0, 2), "two people walk along +x over it"
    assert (first["hall_people"], first["hall_enter"], first["hall_leave"]) == (2, 2, 0)
    assert first["hall_dwell_mean_s"] == 0.5, "in the last frame of the two"
    assert (second["hall_people"], second["hall_people_mean"], second["hall_dwell_mean_s"]) == (1, 1.0, 0.5)
    with pytest.warns(UserWarning, match="far lies outside all positions, which have x from"):
        far = run_tables(walk(), FPS, parse_places(["far=90,-1,90,5"], []))
    assert rows(far.counts)[0]["far_to_left"] == 0


def test_each_passage_has_a_row():
    tables = run_tables(way([1, 2, 3, 4, 5, 4, 3]), FPS, PLACES)
    found = [(r["place"], r["direction"], r["id"], r["frame"], r["t_s"]) for r in rows(tables.crossings)]
    assert found == [
        ("door", "to_right", 1, 4, 1.5), ("door", "to_left", 1, 7, 3.0), ("hall", "enter", 1, 5, 2.0),
        ("hall", "leave", 1, 6, 2.5),
    ]  # fmt: skip
    (person,) = rows(tables.people_summary)
    assert person["hall_dwell_s"] == 0.5
    assert "door_dwell_s" not in person


def test_who_stands_on_a_line_crosses_it_once():
    assert crossed(way([3, 3.4, 3.6, 3.4, 3.6, 3.4, 4])) == (0, 1)
    assert crossed(way([3, 3.4, 3.6, 3.4, 3.6, 3.4, 4]), margin=0.0) == (2, 3), "each change of side"


def test_intervals_begin_at_the_start_and_end_at_the_end():
    tables = run_tables(walk(), FPS, PLACES, every=20, start=1.5, end=45)
    assert [(c["t_start_s"], c["t_end_s"], c["minute"]) for c in rows(tables.counts)] == [
        (1.5, 21.5, 0), (21.5, 41.5, 0), (41.5, 45, 0),
    ]  # fmt: skip
    assert [c["people"] for c in rows(tables.counts)] == [2, 0, 0]
    assert [c["observed_s"] for c in rows(tables.counts)] == [20, 20, 3.5]
    assert {r["frame"] for r in rows(tables.crossings)} == {4, 5}, "both cross the door at 1.5 s, then enter the hall"
    assert rows(run_tables(walk(), FPS, PLACES, start=2, end=3).crossings)[0]["place"] == "hall"
    assert len(rows(run_tables(walk(), FPS, end=1e6).counts)) == 2, "no interval after what was observed"
    assert rows(tables.people) == rows(run_tables(walk(), FPS).people), "of counts and crossings only"


@pytest.mark.parametrize("every", [0.5, 3, 7.3, 60])
def test_sums_over_intervals_do_not_depend_on_their_length(every):
    for truth in (make_sequence(0).truth, make_sequence(3).truth):
        middle = np.median(truth.pos if truth.pos is not None else truth.box[:, :2], axis=0)
        size = 10 if truth.pos is not None else 500
        places = {"line": np.array([middle - size, middle + size]),
                  "zone": middle + size / 4 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])}  # fmt: skip
        tables = truth_tables(truth.replace(px_per_m=40.0), places, every=every)
        counts, found = tables.counts.columns, tables.crossings.columns
        for place, direction in (("line", "to_left"), ("line", "to_right"), ("zone", "enter"), ("zone", "leave")):
            pairs = zip(found["place"], found["direction"], strict=True)
            assert np.sum(counts[f"{place}_{direction}"]) == sum(p == (place, direction) for p in pairs)
        inside = np.nansum(counts["zone_dwell_mean_s"] * counts["zone_people"])
        assert inside == pytest.approx(tables.people_summary.columns["zone_dwell_s"].sum())
        assert np.sum(counts["people_new"]) == len(np.unique(truth.id))
        assert counts["observed_s"].sum() == pytest.approx(truth.length / truth.fps)


def test_frames_without_observation_are_unknown():
    """Nobody looked in frames 5 to 12; who was on the other side then has crossed."""
    tracks = [*way([1, 2, 3, 3]), *(frame(k, {1: (5, 0, -1)}) for k in range(13, 17))]
    first, second, third, last = rows(run_tables(tracks, FPS, PLACES, every=2.5).counts)
    assert (first["observed_s"], first["door_to_right"], first["people_mean"]) == (2.0, 0, 1.0)
    unknown = {key for key, value in second.items() if value is None}
    assert second["observed_s"] == 0.0
    assert unknown == set(second) - {"minute", "t_start_s", "t_end_s", "observed_s"}
    assert (third["observed_s"], third["door_to_right"], third["door_to_right_per_min"]) == (1.5, 1, 40.0)
    assert (last["observed_s"], last["hall_people_mean"], last["hall_dwell_mean_s"]) == (0.5, 1.0, 0.5)


def test_nobody_in_an_observed_frame_is_zero():
    (only,) = rows(run_tables(way([None, None]), FPS, PLACES).counts)
    assert (only["people"], only["door_to_left"], only["hall_people"], only["people_mean"]) == (0, 0, 0, 0.0)
    assert only["hall_dwell_mean_s"] is None, "of nobody"


def test_lines_in_the_image_have_a_margin_in_px():
    line = {"door": np.array([[100.0, 0.0], [100.0, 50.0]])}
    tracks = [frame(k, {1: (x, 20, -1)}, plane="image") for k, x in enumerate([90, 104, 96, 104, 106], 1)]
    for scale, expected in ((20, 1), (4, 3)):
        found = run_tables(tracks, FPS, line, px_per_m=scale).counts.columns
        assert (found["door_to_left"].sum() + found["door_to_right"].sum()) == expected, scale
    with pytest.raises(InputError, match="--px-per-m"):
        run_tables(tracks, FPS, line)
    assert len(rows(run_tables(tracks, FPS).counts)) == 1, "without places no scale is needed"


def test_who_is_only_predicted_is_on_no_side():
    """A track that is predicted on beyond the line has not crossed it until it is measured there."""
    tracks = way([2, 3, 4, 5])
    for k in (2, 3):
        tracks[k] = tracks[k].replace(seen=np.array([False]))
    assert crossed(tracks) == (0, 0)
    assert crossed([*tracks, frame(5, {1: (5, 0, -1)})]) == (0, 1)


@pytest.mark.parametrize(
    ("variance", "expected"), [(0.3**2, (0, 1)), (0.01**2, (1, 2)), (1.0, (1, 2)), (np.nan, (1, 2))]
)
def test_the_margin_grows_with_the_known_error(variance, expected):
    """A covariance that is the identity, or nan, is not known."""
    assert crossed(way([2, 4, 3, 5], cov=variance * np.eye(4)[None])) == expected


def test_narrow_zones_have_a_smaller_margin():
    zone = {"strip": np.array([[2.9, -9.0], [3.1, -9.0], [3.1, 9.0], [2.9, 9.0]])}
    columns = run_tables(way([2, 3, 4]), FPS, zone).counts.columns
    assert (columns["strip_enter"].tolist(), columns["strip_leave"].tolist()) == ([1], [1])


WRONG = [
    ({"every": 0.4}, "--every: got 0.4 s; expected one frame, 0.5 s"), ({"start": 90.0}, "--start: got 90 s"),
    ({"start": 5.0, "end": 5.0}, "--end: got 5 s; expected a time after the start"), ({"margin": -0.1}, "--margin"),
    ({"min_duration": -1.0}, "--min_duration"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "line"), WRONG)
def test_options_that_cannot_be_are_refused(options, line):
    with pytest.raises(InputError) as caught:
        run_tables(walk(), FPS, PLACES, **options)
    assert line in caught.value.line()
