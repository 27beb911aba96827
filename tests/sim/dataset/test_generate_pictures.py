"""Datasets with pictures: the same bytes however they are made, also after a kill in the middle of them."""

from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import Entry
from sim.dataset.generate import generate
from sim.store.validate import validate
from tests.fake_simulator import content, scenario
from tracking.recordings.source import open_source


def test_streams_are_asked_for_and_stored(tmp_path, simulate):
    made = generate([Entry("x", scenario())], range(2), tmp_path, streams=["right", "left"], images="png")
    assert simulate.asked == [(seed, ("left", "right", "background")) for seed in (0, 1)]
    (sequence,) = open_source(made[0])
    assert (sequence.has_images, sequence.has_right) == (True, True)
    simulate.asked.clear()
    generate([Entry("x", scenario())], range(2), tmp_path, streams=["right", "left"], images="png")
    assert simulate.asked == []


def test_pictures_of_the_empty_scene_are_left_out_where_asked(tmp_path, simulate):
    """Background models are then trained on frames, as those of a recording."""
    for _ in range(2):
        (made,) = generate([Entry("x", scenario())], range(1), tmp_path, streams=["left"], background=False)
    assert simulate.asked == [(0, ("left",))], "kept the second time"
    assert not (made / "background").exists()
    assert validate(made) == []
    (sequence,) = open_source(made)
    assert sequence.background().shape == (sequence.length, *sequence.background().shape[1:])
    assert sequence.source["background"] == f"{sequence.length} frames spread over the recording (not causal)"
    with pytest.raises(InputError, match="streams \\['left'\\]; expected streams \\['left', 'background'\\]"):
        generate([Entry("x", scenario())], range(1), tmp_path, streams=["left"])


def alter(path: Path) -> None:
    """Other bytes, as many as before."""
    path.write_bytes(path.read_bytes()[:-5] + bytes(5))


@pytest.mark.parametrize("harm", [alter, Path.unlink])
@pytest.mark.parametrize("name", ["img1/000003.jpg", "background/000009.jpg"])
def test_altered_pictures_are_made_anew(tmp_path, simulate, harm, name):
    (made,) = generate([Entry("x", scenario())], range(1), tmp_path, streams=("left",))
    before = content(tmp_path)
    harm(made / name)
    simulate.asked.clear()
    generate([Entry("x", scenario())], range(1), tmp_path, streams=("left",))
    assert [seed for seed, _ in simulate.asked] == [0]
    assert content(tmp_path) == before
