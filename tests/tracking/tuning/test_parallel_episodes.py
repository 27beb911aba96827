"""Episodes by other processes: as here, or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.errors import WorkError
from tests.tuning_toys import TOY, write_scenes
from tracking.environment.episodes import sources
from tracking.tuning.parallel_episodes import EpisodeTask, play_task
from tracking.tuning.tuned_tracker import tuned_tracker


def test_a_worker_whose_tracker_is_another_one_ends_it_all(tmp_path: Path) -> None:
    """An answer would be taken for one about the parameters."""
    (source,) = sources(write_scenes(tmp_path)[0], (1,))
    same, other = (EpisodeTask(TOY, source, {}, "file", False, code) for code in (tuned_tracker(TOY).code, "another"))
    assert play_task(same).frames == 20
    with pytest.raises(WorkError, match=r"another .*toy_tracker.py:Toy in a worker; .* start the workers anew"):
        play_task(other)


def test_trackers_that_draw_do_so_by_the_source(tmp_path: Path) -> None:
    """Else all episodes would be tuned to one and the same luck."""
    text = Path(TOY.rpartition(":")[0]).read_text()
    lucky = text.replace("self.fps = context.fps", "self.fps, self.config = context.fps, ToyConfig(skip=seed % 5)")
    assert lucky != text
    (tmp_path / "lucky.py").write_text(lucky)
    name = f"{tmp_path / 'lucky.py'}:Toy"
    for source in sources(write_scenes(tmp_path)[0], (5, 9)):
        own, fixed = (
            play_task(EpisodeTask(name, source, {}, "file", True, tuned_tracker(name).code)),
            play_task(EpisodeTask(TOY, source, {"skip": source.seed % 5}, "file", True, tuned_tracker(TOY).code)),
        )
        assert own.scores == fixed.scores
