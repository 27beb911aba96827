"""Which scenarios share looks: none; a dataset that is drawn again has its own."""

from __future__ import annotations

import numpy as np

import sim
from scenarios import load
from scenarios.loading.toml_files import dump
from scenarios.schema.pictures import Light, Picture
from sim.hashing import canonical_hash
from sim.render.renderer import Renderer
from tests.reference_sense import crowd, pinhole, small

LIGHT, PICTURE = Light(cloud=0.2, drift=0.1, flicker=0.1), Picture(foliage=0.1)


def test_a_name_changes_all_looks_and_no_truth() -> None:
    made = crowd(3, people=5, frames=2)
    one, other = (Renderer(made.replace(name=name), small(pinhole()), LIGHT, PICTURE) for name in ("one", "other"))
    assert not np.allclose(one.illumination.sun, other.illumination.sun)
    assert not np.allclose(one.illumination.clouds.k, other.illumination.clouds.k)
    assert one.illumination.gain(0.1, 3) != other.illumination.gain(0.1, 3)
    views = one.left_view, other.left_view
    assert not np.array_equal(*(view.empty_scene.plants for view in views))
    assert not np.array_equal(*(view.empty_scene.colour[view.geometry.kind == 1] for view in views))
    assert not np.array_equal(one._atlas, other._atlas)
    bare = (Renderer(made.motion, made.camera) for made in (one, other))
    noise = [np.subtract(*(made.background(k).astype(float) for k in (0, 1))).ravel() for made in bare]
    assert abs(np.corrcoef(*noise)[0, 1]) < 0.05
    assert canonical_hash(one.pixels(1)) == canonical_hash(other.pixels(1))


def test_a_stored_scenario_is_drawn_again_with_its_own_looks(tmp_path) -> None:
    scenario = load("cross", ["camera.image=[64, 48]", "duration=1"]).model_copy(update={"name": "entry-7"})
    (tmp_path / "scenario.toml").write_text(dump(scenario))
    live, again = (sim.simulate(s, 2) for s in (scenario, load(tmp_path / "scenario.toml")))
    assert np.array_equal(next(live.frames()).image, next(again.frames()).image)
    assert np.array_equal(live.background(), again.background())
