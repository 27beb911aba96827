"""A scenario and a seed as a Sequence: motion, camera, truth and detections, each made when first asked for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.render.renderer import Rendered, Stage, stage
from sim.scene.camera import px_per_m_at_centre
from sim.scene.camera_placement import place_camera
from sim.truth.label import bodies, label
from sim.truth.order_fulfilment import check_orders
from sim.types import (
    BACKGROUNDS,
    OWN_BACKGROUND,
    Camera,
    Detections,
    Frame,
    Image,
    Motion,
    Order,
    PixelTruth,
    Scene,
    Sequence,
    Truth,
)

if TYPE_CHECKING:
    from scenarios.schema.observation import ObservationSpec
    from scenarios.schema.scenario import Scenario

STREAMS = frozenset({"left", "right", "disparity", "ids", "background"})


def simulate(scenario: Scenario, seed: int, repeat: int = 0, streams: Iterable[str] = ("left",)) -> Sequence:
    """Run the world and look at it: pictures, points and boxes by the scenario's sensor, truth by its camera.

    streams, some of STREAMS: which pictures the frames have (`left`, `right`), drawn as frames are asked for, and what
    is known of pixels (`ids`, `disparity`); () none. InputError where the scenario cannot be (no room, people out of
    view, a right view without a baseline).
    """
    from sim.crowd.world import run

    return observe(scenario, run(scenario, seed, repeat), streams=streams)


def observe(
    scenario: Scenario | ObservationSpec,
    motion: Motion,
    *,
    people: Mapping[str, tuple[int, ...]] | None = None,
    check: bool = True,
    streams: Iterable[str] = (),
) -> Sequence:
    """The sequence that the scenario's camera and sensor make of a Motion.

    check: asking for the truth of a Motion whose orders did not come true is a WorkError.
    The camera is solved at once (a scenario whose people leave the view is refused here); truth and detections are
    lazy, and detections never touch the truth that the sequence gives out. people: ids of each of the script's groups,
    where `sensor.hide` names one and the motion was not made from the scenario itself. streams: as for `simulate`;
    any of them brings empty frames for a background and exact pixels, with disparities if those are a stream.
    """
    camera = place_camera(scenario.camera, motion)
    drawn = _pictures(streams, scenario, motion, camera)

    @cache
    def named() -> Mapping[str, tuple[int, ...]]:
        if people is not None:
            return people
        from scenarios.schema import scenario as schema

        assert isinstance(scenario, schema.Scenario), "a view knows no groups: give people"
        return named_people(scenario, motion.scene, motion.seed, motion.repeat, motion.orders)

    @cache
    def detections() -> list[Detections]:
        from sim.detector.sense import sense

        hidden = named() if any(hide.group is not None for hide in scenario.sensor.hide) else {}
        seen = bodies(motion, camera)
        return sense(seen, scenario.sensor, motion.seed, camera, camera.image, motion.repeat, hidden)

    def bare() -> Iterator[Frame]:
        return (Frame(d.index, d.t, detections=d) for d in detections())

    def frames() -> Iterator[Frame]:
        for d in detections():
            made = Rendered() if drawn is None else drawn.draw(d.index)
            yield Frame(d.index, d.t, made.image, made.right, d)

    def truth() -> Truth:
        found = label(motion, camera)
        if check:
            check_orders(motion, found)
        return found

    return Sequence(
        name=motion.name,
        fps=motion.fps,
        length=len(motion.present),
        frames=frames,
        load_truth=truth,
        image_size=camera.image,
        camera=camera,
        scene=motion.scene,
        px_per_m=px_per_m_at_centre(camera),
        has_detections=True,
        load_people=named,
        source={
            "kind": "simulated",
            "seed": motion.seed,
            "repeat": motion.repeat,
            **({} if drawn is None else {"background": OWN_BACKGROUND}),
        },
        has_images=drawn is not None and drawn.has_image,
        has_right=drawn is not None and drawn.has_right,
        bare=bare,
        load_background=None if drawn is None else drawn.background,
        load_pixels=None if drawn is None else drawn.pixels,
    )


class _Pictures:
    """The pictures that were asked for. Holds the exact pixels of the frame drawn last: they are often wanted next."""

    def __init__(self, stage: Stage, streams: frozenset[str]) -> None:
        self.stage, self.streams = stage, streams
        self.has_image, self.has_right = "left" in streams, "right" in streams
        self._last: tuple[int, PixelTruth | None] = (0, None)

    def draw(self, index: int) -> Rendered:
        """The frame's pictures, and its exact pixels where a stream shows them."""
        if not self.has_image:
            return Rendered(right=self.stage.right(index) if self.has_right else None)
        labels = not self.streams.isdisjoint({"ids", "disparity"})
        made = self.stage.both(index, right=self.has_right, pixels=labels, disparity="disparity" in self.streams)
        self._last = index, made.pixels
        return made

    def pixels(self, index: int) -> PixelTruth:
        """Exact pixels of a frame, with disparities if they are a stream."""
        last, known = self._last
        if known is not None and last == index:
            return known
        return self.stage.pixels(index, disparity="disparity" in self.streams)

    def background(self) -> Image:
        """Empty frames before the first (BACKGROUNDS, H, W, 3)."""
        return np.stack([self.stage.background(k) for k in range(BACKGROUNDS)])


def _pictures(
    streams: Iterable[str], scenario: Scenario | ObservationSpec, motion: Motion, camera: Camera
) -> _Pictures | None:
    wanted = frozenset(streams)
    if not wanted <= STREAMS:
        raise InputError(
            place="streams", got=", ".join(sorted(wanted - STREAMS)), expected=f"some of {', '.join(sorted(STREAMS))}",
            remedy="leave it out",
        )  # fmt: skip
    if not wanted:
        return None
    made = stage(motion, camera, scenario.light, scenario.picture)
    if not wanted.isdisjoint({"right", "disparity"}):
        made.check_pair()
    return _Pictures(made, wanted)


def named_people(
    scenario: Scenario, scene: Scene, seed: int, repeat: int, orders: Iterable[Order]
) -> dict[str, tuple[int, ...]]:
    """Ids of the people of each group that the script names: those it starts with, and those its orders made."""
    from sim.crowd.population import draw_population

    parties = draw_population(scenario, scene, seed, repeat)
    names = {party.name: tuple(m.column + 1 for m in party.members) for party in parties}
    after = {order.id: order.after for order in orders if order.fired is not None}
    for event in scenario.event:
        made = after.get(event.id)
        if made is None:
            continue
        if event.type == "merge":
            names[event.into] = made[0]
        elif event.type == "split":
            names |= {part.id: ids for part, ids in zip(event.parts, made, strict=True)}
    return names
