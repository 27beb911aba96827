"""Values that are drawn once for each seed in places of fixed ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.loading.toml_files import dump
from sim.crowd.world import run
from sim.dataset.generate import generate
from sim.draws import drawn
from sim.sequence import simulate

SCENE = """
schema = 1
duration = { uniform = [4, 6] }
draw = { night = { choice = [0, 1] }, busy = { uniform = [0, 4] } }
world = { size = [{ uniform = [18, 22] }, 16] }
camera = { tilt_deg = { uniform = [30, 60] }, image = { choice = [[64, 48], [80, 60]] }, fps = { choice = [5, 10] } }
sensor = { detect_prob = { link = "night", values = [0.9, 0.5] }, clutter_rate = { link = "busy" } }
light = { shadow = { link = "night", values = [0.4, 0.0] } }
picture = { jpeg = { uniform = [50, 90] }, noise = { exponential = 3.0, clip = [0, 20] } }
group = [
  { id = "a", size = 1, start = [{ uniform = [2, 16] }, 8], goal = [9, 2], repeat = { uniform = [2, 5] } },
]
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


def test_each_seed_draws_every_kind_of_value(path: Path) -> None:
    scenario = load(path)
    made = [drawn(scenario, seed) for seed in range(40)]
    for low, high, values in [
        (4, 6, [s.duration for s in made]), (18, 22, [s.world.size[0] for s in made]),
        (30, 60, [s.camera.tilt_deg for s in made]), (0, 4, [s.sensor.clutter_rate for s in made]),
        (0, 20, [s.picture.noise for s in made]),
    ]:  # fmt: skip
        assert low <= min(values) < np.mean(values) < max(values) <= high
        assert len(set(values)) == 40
        assert (max(values) - min(values)) > 0.7 * (high - low) or high == 20
    shares = [((s.duration - 4) / 2, (s.camera.tilt_deg - 30) / 30) for s in made]
    assert abs(np.corrcoef(np.transpose(shares))[0, 1]) < 0.4, "two keys are independent"
    assert {s.camera.image for s in made} == {(64, 48), (80, 60)}
    assert {s.camera.fps for s in made} == {5.0, 10.0}
    assert {s.group[0].repeat for s in made} == {2, 3, 4, 5}
    assert all(isinstance(s.picture.jpeg, int) and 50 <= s.picture.jpeg <= 90 for s in made)
    assert all(s.draw is None and s.draws is None and drawn(s, 1) is s for s in made)


def test_links_to_one_name_agree(path: Path) -> None:
    scenario = load(path)
    pairs = {(s.sensor.detect_prob, s.light.shadow) for s in (drawn(scenario, seed) for seed in range(40))}
    assert pairs == {(0.9, 0.4), (0.5, 0.0)}


def test_each_key_has_a_stream_of_its_own(path: Path) -> None:
    """Another draw, before or after it in the file, changes no value; a copy of a suite's entry draws its own."""
    more = load(path, ["warmup={uniform=[1, 2]}", "light.penumbra={uniform=[0, 1]}", "draw.a={choice=[1, 2, 3]}"])
    for seed in range(5):
        once, again = drawn(load(path), seed), drawn(more, seed)
        changed = {"warmup": again.warmup, "light": again.light}
        assert once.model_copy(update=changed) == again
    assert drawn(more, 0, repeat=1).duration != drawn(more, 0, repeat=2).duration != drawn(more, 0).duration


def test_what_is_not_drawn_keeps_its_bits(path: Path) -> None:
    settings = ["duration=5", "world.size=[20, 16]", "group.a.repeat=3", "camera.fps=10"]
    still = ["camera.tilt_deg=40", "camera.image=[64, 48]", "sensor={}", "light={}", "picture={}"]
    one, other = (run(load(path, [*settings, *more]), 3) for more in ([], still))
    assert np.array_equal(one.pos, other.pos)


def test_a_sequence_is_made_of_the_drawn_scenario(path: Path) -> None:
    scenario = load(path)
    for seed in range(4):
        made, sequence = drawn(scenario, seed), simulate(scenario, seed, streams=())
        assert (sequence.fps, sequence.image_size) == (made.camera.fps, made.camera.image)
        assert sequence.length == round(made.duration * made.camera.fps)
        assert len(np.unique(sequence.truth.id)) == made.group[0].repeat


def test_a_dataset_has_the_drawn_scenario_of_each_seed(path: Path, tmp_path: Path) -> None:
    generate([str(path)], range(2), tmp_path / "out", streams=())
    for seed in range(2):
        folder = tmp_path / f"out/flockscope-train/scene-s{seed:05d}"
        assert (folder / "scenario.toml").read_text() == dump(drawn(load(path), seed))
        assert load(folder / "scenario.toml") == drawn(load(path), seed)


def test_drawn_values_that_do_not_fit_each_other_are_refused_with_their_seed(path: Path) -> None:
    """Each fits alone: a group that enters at 6.5 s, a recording of 4 s."""
    late = ["duration={choice=[9, 4]}", "group.a.enter={link='late'}", "draw.late={choice=[0, 6.5]}"]
    with pytest.raises(InputError, match=r"scenario scene \(seed \d+\): group\.a\.enter: got 6\.5 s"):
        [drawn(load(path, late), seed) for seed in range(20)]


def test_looks_are_drawn_for_each_scenario_anew(path: Path) -> None:
    """Another name changes draws of light and picture, and no other."""
    one = load(path, ["light.penumbra={uniform=[0, 1]}", "picture.noise={uniform=[0, 9]}"])
    made, other = (drawn(scenario, 3) for scenario in (one, one.model_copy(update={"name": "other"})))
    assert made.light.penumbra != other.light.penumbra
    assert made.picture.noise != other.picture.noise
    kept = {"name": made.name, "light": made.light, "picture": made.picture}
    assert other.model_copy(update=kept) == made
