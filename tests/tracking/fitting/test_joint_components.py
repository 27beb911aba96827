"""The fit of the Dirichlet process mixture: a known mixture is found again, the command writes a file."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tests.short_scene import SCENE
from tracking.app.cli import run
from tracking.fitting.joint_components import TruePartition, component_scores, fit_components
from tracking.papers.joint.config import FITTED_MIXTURE, JointConfig, mixture_of
from tracking.papers.joint.dirichlet_process_kernels import propose

TRUE = {"concentration": 0.02, "spread_degrees": 6.0, "place_spread": 0.6, "velocity_spread": 0.3}


def drawn(count, people=8):
    """Partitions of people who are anywhere, drawn from p(Z | X) by Gibbs sampling."""
    rng = np.random.default_rng(0)
    state = np.concatenate([rng.uniform(0, 5, (count, people, 2)), rng.uniform(0, 0.8, (count, people, 2))], axis=-1)
    label = np.zeros((count, 1, people), np.int64)
    for _ in range(60):
        propose(state, label, np.ones(people), rng.random((count, 1, people, 2)), mixture_of(TRUE))
    return [TruePartition(x, z[0]) for x, z in zip(state, label, strict=True)]


def test_the_fit_finds_its_mixture():
    parts = drawn(4000)
    fitted = fit_components(parts)
    assert list(fitted) == list(TRUE)
    assert fitted["place_spread"] == pytest.approx(0.6, rel=0.06)
    assert fitted["velocity_spread"] == pytest.approx(0.3, rel=0.06)
    assert fitted["concentration"] == pytest.approx(0.02, rel=0.15)
    assert fitted["spread_degrees"] == pytest.approx(6.0, rel=0.35)
    assert component_scores(parts, fitted)["log_loss"] <= component_scores(parts, TRUE)["log_loss"]


def test_without_groups_nothing_is_fitted():
    alone = TruePartition(np.zeros((3, 4)), np.zeros(3, np.int64))
    with pytest.raises(InputError, match="1 partitions, 0 with a group"):
        fit_components([alone])
    with pytest.raises(InputError, match="0 partitions"):
        fit_components([])


def test_the_command_writes_the_mixture(tmp_path, capsys):
    groups = [("a", 2, [5, 5], [12, 4]), ("b", 2, [9, 5], [4, 6]), ("c", 1, [6, 5], [12, 5])]
    people = ", ".join(f'{{ id = "{g}", size = {n}, start = {a}, goal = {b} }}' for g, n, a, b in groups)
    crowd = SCENE[: SCENE.index("\ngroup")] + f"\ngroup = [{people}]\n"
    scene, out = tmp_path / "scene.toml", tmp_path / "fitted.toml"
    scene.write_text(crowd)
    line = ["fit", "joint", str(scene), "--learn", "components", "--seeds", "30000:30003", "--check", "30020"]
    assert run([*line, "--out", str(out)]) == 0
    fitted = JointConfig.from_toml(out)
    assert fitted.place_spread != FITTED_MIXTURE["place_spread"]
    assert fitted.merge_bias == JointConfig().merge_bias
    assert out.read_text().startswith(f"# flockscope fit joint {scene} --learn components --seeds 30000:30003")
    assert "checked, seeds 30020:30021: partitions" in out.read_text()
    assert "--params" in capsys.readouterr().out
