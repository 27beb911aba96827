"""Texts for TrajNet++ and PedPy: their lines, and the same people when they are read again."""

from __future__ import annotations

import json

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.export.tidy_tables import run_tables, write_tables
from sim.io.source import open_source
from tests.sim.io.export.test_tidy_tables import frame, walk


@pytest.mark.parametrize("form", ["trajnet", "pedpy"])
def test_round_trip(tmp_path, form):
    tables = run_tables(walk(), 2.0)
    (path,) = write_tables(tables, tmp_path, form, {"fps": 2.0})
    (back,) = open_source(path)
    people, truth = tables.people.columns, back.truth
    assert back.fps == 2.0
    assert np.array_equal(truth.frame, people["frame"])
    assert np.array_equal(truth.id, people["id"])
    assert np.allclose(truth.pos, np.column_stack([people["x_m"], people["y_m"]]), atol=1e-4)


def test_lines(tmp_path):
    (path,) = write_tables(run_tables(walk(), 2.0), tmp_path, "trajnet", {"fps": 2.0})
    scene, *_, last = map(json.loads, path.read_text().splitlines())
    assert scene == {"scene": {"id": 0, "p": 1, "s": 1, "e": 5, "fps": 2.0}}
    assert last == {"track": {"f": 121, "p": 3, "x": 9.0, "y": 9.0}}
    (path,) = write_tables(run_tables(walk(), 2.0), tmp_path, "pedpy", {"fps": 2.0})
    assert path.read_text().splitlines()[:3] == ["# framerate: 2", "# id\tframe\tx/m\ty/m", "1\t1\t1.0000\t0.0000"]


def test_people_in_the_image_are_refused(tmp_path):
    with pytest.raises(InputError, match="people in the image"):
        write_tables(run_tables([frame(1, {1: (3, 4, -1)}, plane="image")], 2.0), tmp_path, "pedpy", {"fps": 2.0})
