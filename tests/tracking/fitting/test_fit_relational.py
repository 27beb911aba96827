"""The fit of `relational`: known weights are found again, and the command writes a file that is read."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tests.short_scene import SCENE
from tracking.app.cli import run
from tracking.fitting.relational import fit_relational, logistic
from tracking.papers.relational.config import RelationalConfig

ENDS = RelationalConfig().speed_ends


def test_logistic_regression_finds_its_weights():
    rng = np.random.default_rng(0)
    design = np.stack([np.ones(40_000), -rng.exponential(2, 40_000), -rng.exponential(0.5, 40_000)], axis=1)
    true = np.array([3.0, 1.5, 4.0])
    same = rng.random(40_000) < 1 / (1 + np.exp(-design @ true))
    np.testing.assert_allclose(logistic(design, same), true, rtol=0.05)


def test_pairs_that_a_line_separates_have_finite_weights():
    distance = np.linspace(0, 4, 400)
    weights = logistic(np.stack([np.ones(400), -distance, np.zeros(400)], axis=1), distance < 1.5)
    assert weights[0] / weights[1] == pytest.approx(1.5, abs=0.05)
    assert weights[2] == 0
    assert 3 < weights[1] < 30


def test_without_scenes_nothing_is_fitted():
    with pytest.raises(InputError, match="0 changes of velocity"):
        fit_relational([], ENDS)


def test_the_command_writes_parameters(tmp_path, capsys):
    crowd = SCENE.replace("duration = 2.0", "duration = 12.0").replace("size = 2", "size = 3")
    people = '{ id = "a", size = 3, start = [4, 4], goal = [12, 4] }, { id = "b", start = [12, 6], goal = [4, 6] }'
    other = f"\ngroup = [{people}]"
    scene = tmp_path / "scene.toml"
    scene.write_text(crowd[: crowd.index("\ngroup")] + other)
    out = tmp_path / "fitted.toml"
    assert run(["fit", "relational", str(scene), "--seeds", "30000:30006", "--out", str(out)]) == 0
    fitted = RelationalConfig.from_toml(out)
    assert fitted.relation_distance > 0
    assert 0 < fitted.diffusion[4] < 1
    assert "--params" in capsys.readouterr().out
