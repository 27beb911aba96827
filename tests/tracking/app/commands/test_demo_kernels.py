"""The made-up scene by which `demo --quick` compiles kernels ahead: trackers see its people, as in simulated scenes."""

from __future__ import annotations

import pytest

from tracking.app.commands import demo


@pytest.mark.parametrize("tracker", demo.QUICK_TRACKERS)
def test_trackers_see_the_made_up_people(tracker: str, monkeypatch: pytest.MonkeyPatch) -> None:
    runs, run = [], demo.TrackerSetup.run
    monkeypatch.setattr(demo.TrackerSetup, "run", lambda *given: runs.append(run(*given)))
    demo._compile(tracker)
    assert max(len(t.id) for t in runs[0]) >= {"blob": 4, "group-pda": 2}[tracker]
