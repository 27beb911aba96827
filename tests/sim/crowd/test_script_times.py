"""The script says who belongs together; when it came about is measured: no time in its record changes a measurement."""

import json
from dataclasses import replace

import pytest

from scenarios.loading.resolve import load
from sim.crowd.world import run
from sim.io.store.truth_files import truth_files
from sim.sequence import observe

MEASURED = ("gt/events.json", "gt/near.csv", "gt/groups.csv", "gt/groups.parquet", "gt/groups_px.parquet")
DATED = {"merge": {"merge", "form"}, "split": {"split", "dissolve"}, "queue": {"queue"}}


def measured(scenario, motion):
    """The truth's files, measured anew from a motion."""
    return truth_files(observe(scenario, motion, check=False).truth.replace(orders=()))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", ["merge", "split", "queue", "party", "mixed"])
def test_times_deleted_from_the_script_change_no_onset(name, seed):
    scenario = load(name, ["camera.fps=5"])
    motion = run(scenario, seed)
    files = measured(scenario, motion)
    events = json.loads(files["gt/events.json"])["events"]
    assert {o.kind for o in motion.orders}
    assert all(any(e["kind"] in DATED[o.kind] for e in events) for o in motion.orders), "there are onsets to be moved"
    fired = {o.fired for o in motion.orders}
    onsets = {e["start"] for e in events if e["kind"] in set().union(*DATED.values())}
    assert not fired & onsets, "an onset is no order's time"
    for fired, time in ((None, None), (1, 0.0), (7, 1.2)):
        orders = tuple(replace(o, fired=fired, time=time) for o in motion.orders)
        again = measured(scenario, motion.replace(orders=orders))
        assert all(again[file] == files[file] for file in MEASURED)
        assert again.keys() == files.keys()
