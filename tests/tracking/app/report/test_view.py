"""What `view` refuses before it writes anything, and what it does without the packages of a report."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.errors import InputError
from sim.types import Sequence
from tracking.app.command_options import ViewOptions
from tracking.app.commands import view


@pytest.fixture
def options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ViewOptions:
    """Two runs of two sequences, which have no labels."""
    bare = [Sequence(name, 10.0, 1, lambda: iter(())) for name in ("a", "b")]
    monkeypatch.setattr(view, "_open", lambda _: bare)
    return ViewOptions(source=tmp_path, tracks=["one", "two"], out=tmp_path / "out")


def test_several_runs_need_labels(options: ViewOptions) -> None:
    with pytest.raises(InputError, match="no labels"):
        view.view(options)
    assert not options.out.exists()
