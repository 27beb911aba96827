"""Groups without formation are flocks: each of the three forces does what Reynolds (1987) says."""

from __future__ import annotations

import pytest

from benchmarks.realism import FlockState, flock_walk


def after(size: int, formation: str = "none", off: str | None = None) -> FlockState:
    """Returns the state of a group that has walked for half a minute."""
    return flock_walk(size, formation, range(1000, 1003), off)[1]


@pytest.mark.parametrize("size", [3, 12])
def test_separation_keeps_members_an_arm_apart(size: int) -> None:
    assert 0.6 <= after(size).neighbour <= 0.95
    assert after(size, off="separation").neighbour < 0.65 * after(size).neighbour


@pytest.mark.parametrize("size", [3, 12])
def test_cohesion_holds_them_together(size: int) -> None:
    assert after(size).radius < 1.2
    assert after(size, off="cohesion").radius > 1.8 * after(size).radius


@pytest.mark.parametrize("size", [3, 12])
def test_alignment_makes_them_walk_alike(size: int) -> None:
    assert after(size).spread < 0.9 * after(size, off="alignment").spread
    assert after(size).polarisation > after(size, off="alignment").polarisation


def test_the_factors_act_in_a_formation_too() -> None:
    usual = after(12, "rows")
    assert after(12, "rows", "cohesion").radius > 1.1 * usual.radius
    assert after(12, "rows", "alignment").spread > 1.02 * usual.spread
    assert after(12, "rows", "separation").neighbour < usual.neighbour
