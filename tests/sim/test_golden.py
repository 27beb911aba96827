"""Truth and detections are what they were, to the last bit, whatever the processor (benchmarks/golden.py)."""

from __future__ import annotations

import pytest

from benchmarks import golden
from scenarios.loading.resolve import names
from sim.hashing import ENGINE

KEPT = golden.golden_file()
SOME = ("merge", "queue", "crowd", "stairs")


def test_the_file_is_of_this_engine() -> None:
    assert KEPT["engine"] == ENGINE, f"golden hashes are of engine {KEPT['engine']}; {golden.WRITE}"
    assert sorted(KEPT["scenarios"]) == sorted(names())


@pytest.mark.parametrize("name", names())
def test_truth_and_detections_are_as_they_were(name: str) -> None:
    assert golden.difference(name, KEPT["scenarios"].get(name), golden.present_hashes(name)) == ""


PROCESSORS = [golden.SETTINGS["all of these"], pytest.param(golden.KERNELS, marks=pytest.mark.slow)]


@pytest.mark.parametrize("setting", PROCESSORS, ids=["all of these", "kernels of the oldest processor"])
def test_nothing_depends_on_the_processor(setting) -> None:
    assert golden.under(setting, "scenarios", *SOME) == {name: KEPT["scenarios"][name] for name in SOME}


@pytest.mark.slow
@pytest.mark.parametrize("label", golden.SETTINGS)
def test_no_scenario_depends_on_a_setting(label: str) -> None:
    assert golden.under(golden.SETTINGS[label], "scenarios", *names()) == KEPT["scenarios"]
