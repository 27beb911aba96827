"""A scenario and a seed as a Sequence: motion, camera, truth and detections, each made when first asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sim.camera import px_per_m_at_centre, solve
from sim.orders import check_orders
from sim.render import BACKGROUNDS, Stage, stage
from sim.truth import bodies, label
from sim.types import Camera, Detections, Frame, Image, Motion, Order, PixelTruth, Scene, Sequence, Truth

if TYPE_CHECKING:
    from scenarios.schema import Scenario


def simulate(scenario: Scenario, seed: int, repeat: int = 0, streams: Iterable[str] = ("left",)) -> Sequence:
    """Run the world and look at it: pictures, points and boxes by the scenario's sensor, truth by its camera.

    streams: which pictures the frames have, `left` and `right`, drawn as frames are asked for; () none. InputError
    where the scenario cannot be (no room, people out of view).
    """
    from sim.world import run

    return observe(scenario, run(scenario, seed, repeat), streams=streams)


def observe(
    scenario: Scenario,
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
    any of them brings empty frames for a background and exact pixels, with disparities where `right` is drawn.
    """
    camera = solve(scenario.camera, motion)
    drawn = _drawn(streams, scenario, motion, camera)

    @cache
    def named() -> Mapping[str, tuple[int, ...]]:
        if people is not None:
            return people
        return named_people(scenario, motion.scene, motion.seed, motion.repeat, motion.orders)

    @cache
    def detections() -> list[Detections]:
        from sim.sensors import sense

        hidden = named() if any(hide.group is not None for hide in scenario.sensor.hide) else {}
        seen = bodies(motion, camera)
        return sense(seen, scenario.sensor, motion.seed, camera, camera.image, motion.repeat, hidden)

    def bare() -> Iterator[Frame]:
        return (Frame(d.index, d.t, detections=d) for d in detections())

    def frames() -> Iterator[Frame]:
        if drawn.stage is None:
            yield from bare()
            return
        for d in detections():
            made = drawn.stage.both(d.index, right=drawn.right)
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
        source={"kind": "simulated", "seed": motion.seed, "repeat": motion.repeat},
        has_images=drawn.stage is not None,
        has_right=drawn.right,
        bare=bare,
        load_background=drawn.background,
        load_pixels=drawn.pixels,
    )


@dataclass(frozen=True)
class _Drawn:
    """The pictures that were asked for: what draws them, None without any, and whether there is a right one."""

    stage: Stage | None
    right: bool = False

    @property
    def background(self) -> Callable[[], Image] | None:
        stage = self.stage
        return None if stage is None else lambda: np.stack([stage.background(k) for k in range(BACKGROUNDS)])

    @property
    def pixels(self) -> Callable[[int], PixelTruth] | None:
        stage, right = self.stage, self.right
        return None if stage is None else lambda index: stage.pixels(index, right=right)


def _drawn(streams: Iterable[str], scenario: Scenario, motion: Motion, camera: Camera) -> _Drawn:
    wanted = set(streams)
    if not wanted:
        return _Drawn(None)
    made = stage(motion, camera, scenario.light, scenario.picture)
    right = not wanted.isdisjoint({"right", "disparity"})
    if right:
        made.check_pair()
    return _Drawn(made, right)


def named_people(
    scenario: Scenario, scene: Scene, seed: int, repeat: int, orders: Iterable[Order]
) -> dict[str, tuple[int, ...]]:
    """Ids of the people of each group that the script names: those it starts with, and those its orders made."""
    from sim.cast import cast

    parties = cast(scenario, scene, seed, repeat)
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
