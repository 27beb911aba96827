"""People with limbs, carried things and distractors in pictures, against a slow renderer."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from scenarios.schema.looks import Carry, Distractors, LooksSpec
from scenarios.schema.scenario import Light
from sim.looks import with_looks
from sim.render.people import clothing_atlas
from sim.render.renderer import Renderer
from sim.scene.body import recorded_things
from sim.truth.label import bodies
from sim.types import Camera, Motion, Scene
from tests import reference_render as slow
from tests.reference_sense import above, crowd, pinhole, small

HALF = dict.fromkeys(Carry.model_fields, 0.5)
FULL = LooksSpec(
    figure="limbs",
    colours=0.5,
    carry=Carry(**HALF),
    distractors=Distractors(**dict.fromkeys(Distractors.model_fields, 2)),
)
WALLED = Scene(np.array([16.0, 10.0]), walls=np.array([[[4.0, 3.0], [7.0, 3.4]]]))
VIEWS = {
    "low": small(pinhole(12.0, at=(8.0, -5.0, 2.2)), 0.3).replace(baseline=0.5),
    "high": small(pinhole(40.0), 0.3).replace(baseline=0.5),
    "above": small(above(20.0), 0.3),
}


@cache
def dressed(spec: LooksSpec | None = FULL) -> Motion:
    return with_looks(crowd(3, people=14, frames=12, scene=WALLED), spec)


@cache
def slowly_seen(view: str) -> slow.Seen:
    return slow.look(VIEWS[view], dressed(), 5)


@pytest.mark.parametrize("view", VIEWS)
def test_ids_and_silhouettes_are_those_of_a_slow_renderer(view: str) -> None:
    motion, seen, pixels = dressed(), slowly_seen(view), Renderer(dressed(), VIEWS[view]).pixels(5)
    assert (seen.ids > 0).sum() > 150
    assert (seen.ids == -2).sum() > 150
    assert (pixels.ids != seen.ids).sum() <= 6  # a ray that grazes two things
    for k, person in enumerate(np.flatnonzero(motion.present[4]) + 1):
        assert abs(pixels.amodal_px[k] - seen.amodal[int(person)].sum()) <= 2
        assert pixels.visible_px[k] == (pixels.ids == person).sum()


@pytest.mark.parametrize("view", ["low", "high"])
def test_disparities_are_those_of_a_slow_renderer(view: str) -> None:
    motion, camera = dressed(), VIEWS[view]
    wanted = slow.disparity(slowly_seen(view), camera, motion, 5)
    found = Renderer(motion, camera).pixels(5, disparity=True).disparity
    assert found is not None
    both = np.isfinite(wanted) & np.isfinite(found)
    assert (np.isfinite(wanted) != np.isfinite(found)).sum() <= 40  # of 27,648: grazing rays, and 1 mm of depth
    assert np.sort(np.abs(wanted - found)[both])[-8] < 1e-3


@pytest.mark.parametrize("camera", [pinhole(25.0, at=(8.0, -6.0, 4.5)), above()], ids=["pinhole", "above"])
def test_boxes_and_visibility_are_those_of_the_pixels(camera: Camera) -> None:
    motion = dressed()
    truth, pixels = bodies(motion, camera), Renderer(motion, camera).pixels(2)
    here = truth.rows(2)
    assert truth.box is not None
    hidden = pixels.visibility < 1
    assert hidden.sum() >= 3
    assert np.abs(truth.visibility[here] - pixels.visibility).max() < 0.06
    assert np.abs(truth.box[here] - pixels.box)[~hidden].max() <= 1.0
    alone = Renderer(motion.replace(looks=motion.looks.replace(kind=np.zeros(0, int), turn=np.zeros((12, 0)))), camera)  # type: ignore[union-attr]
    assert (alone.pixels(2).visible_px > pixels.visible_px).any()  # things do hide somebody


def test_plain_looks_are_those_without_the_table() -> None:
    plain, looked = (Renderer(dressed(spec), VIEWS["low"], Light(shadow=0.5)) for spec in (None, LooksSpec()))
    assert np.abs(plain.frame(5).astype(int) - looked.frame(5)).max() <= 1
    assert (plain.pixels(5).ids == looked.pixels(5).ids).all()


def test_shadows_of_limbs_and_things_fall_where_they_stand_before_the_sun() -> None:
    motion, camera = dressed().replace(scene=Scene(np.array([16.0, 10.0]))), small(pinhole(40.0), 0.3)
    made = Renderer(motion, camera, Light(shadow=0.5, penumbra=0.0))
    seen, sun = slow.look(camera, motion, 5), made.illumination.sun
    shadow = slow.in_shadow(seen.place, motion, 5, sun) & (seen.ids == 0) & np.isfinite(seen.depth)
    ratio = made.frame(5).astype(float).sum(2) / made.background(49).astype(float).sum(2)
    inside = shadow & np.roll(shadow, 2, 0) & np.roll(shadow, -2, 0) & np.roll(shadow, 2, 1) & np.roll(shadow, -2, 1)
    assert inside.sum() > 60
    assert np.median(np.abs(ratio[inside] - 0.5)) < 0.03


def test_a_further_person_changes_nobody_elses_pages() -> None:
    motion = dressed(LooksSpec(figure="limbs"))
    few, many = (clothing_atlas(n, 3, 0, None, motion.looks) for n in (2, 3))
    assert (few == many[: len(few)]).all()


def test_things_are_drawn_in_colours_of_their_own() -> None:
    motion, camera = dressed(), VIEWS["low"]
    things = recorded_things(motion, 5, 6)
    assert things is not None
    picture, ids = Renderer(motion, camera).frame(5), Renderer(motion, camera).pixels(5).ids
    assert len(np.unique(picture[ids == -2] // 16, axis=0)) > 40
