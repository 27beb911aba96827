"""People who are close to others: slower by the density, in lanes against each other, round wide corners, on stairs.

Measures and plans are those of benchmarks/rimea.py, on other seeds.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from benchmarks import rimea

SEED = 1000


@pytest.mark.parametrize("density", [0.5, 2.0])
def test_speed_falls_with_density_as_weidmann_measured(density: float) -> None:
    found, speed = rimea.diagram(rimea.ours(partial(rimea.filled, density=density), SEED, 1))
    assert found == pytest.approx(density, abs=0.15)
    assert speed == pytest.approx(rimea.weidmann(density), abs=0.2)


@pytest.mark.parametrize("name", ["2, 3 stairs", "6 round", "10 allocation", "15 many"])
def test_a_row_of_the_guideline_passes(name: str) -> None:
    test = next(test for test in rimea.TESTS if test.name.startswith(name))
    assert rimea.cell(test, range(SEED, SEED + 1), 1, lambda scene, seed: rimea.ours(scene, seed, 1)).endswith("✓")


def test_people_who_meet_form_lanes() -> None:
    order = [rimea.order(rimea.ours(rimea.counterflow, seed, 1)) for seed in range(SEED, SEED + 3)]
    assert np.mean(order) > 0.35  # 0 as at random; 0.06 where nobody evades


def test_the_slow_are_not_stuck_in_a_narrow_door() -> None:
    plan = rimea.bottleneck(np.random.default_rng(SEED), 1, 0.8)
    slow = plan.scenario.model_copy(
        update={"group": tuple(g.model_copy(update={"speed": 0.5}) for g in plan.scenario.group[:3])}
    )
    assert rimea.arrived(rimea.World(slow, SEED, 0).run().states().pos) == 100
