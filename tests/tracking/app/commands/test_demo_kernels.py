"""The made-up scene by which `demo --quick` compiles kernels ahead: trackers see its people, as in simulated scenes."""

from __future__ import annotations

from unittest.mock import Mock

import pytest

from tracking.app.commands import demo


@pytest.mark.parametrize("tracker", demo.QUICK_TRACKERS)
def test_trackers_see_the_made_up_people(tracker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    runs, run = [], demo.TrackerSetup.run
    monkeypatch.setattr(demo.TrackerSetup, "run", lambda *given: runs.append(run(*given)))
    demo._compile(tracker)
    assert max(len(t.id) for t in runs[0]) >= 2


def test_nothing_is_compiled_ahead_that_cannot_be_stored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sim.scene.visibility_kernels.sample_visibility", Mock(stats=Mock(cache_path=None)))
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr("sim.workers.pool.WorkerProcess.send", None)
    with demo._compiled_ahead():
        pass
