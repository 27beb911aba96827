"""A scenario and a seed as a Sequence: motion, camera, truth and detections, each made when first asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

from sim.camera import px_per_m_at_centre, solve
from sim.orders import check_orders
from sim.truth import bodies, label
from sim.types import Detections, Frame, Motion, Sequence, Truth

if TYPE_CHECKING:
    from scenarios.schema import Scenario


def simulate(scenario: Scenario, seed: int, repeat: int = 0) -> Sequence:
    """Run the world and look at it: points and boxes by the scenario's sensor, truth by its camera.

    InputError where the scenario cannot be (no room, people out of view).
    """
    from sim.world import run

    return observe(scenario, run(scenario, seed, repeat))


def observe(
    scenario: Scenario, motion: Motion, *, people: Mapping[str, tuple[int, ...]] | None = None, check: bool = True
) -> Sequence:
    """The sequence that the scenario's camera and sensor make of a Motion.

    check: asking for the truth of a Motion whose orders did not come true is a WorkError.
    The camera is solved at once (a scenario whose people leave the view is refused here); truth and detections are
    lazy, and detections never touch the truth that the sequence gives out. people: ids of each of the script's groups,
    where `sensor.hide` names one and the motion was not made from the scenario itself.
    """
    camera = solve(scenario.camera, motion)

    @cache
    def detections() -> list[Detections]:
        from sim.sensors import sense

        named = people if people is not None else _people(scenario, motion)
        seen = bodies(motion, camera)
        return sense(seen, scenario.sensor, motion.seed, camera, camera.image, motion.repeat, named)

    def frames() -> Iterator[Frame]:
        return (Frame(d.index, d.t, detections=d) for d in detections())

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
        source={"kind": "simulated", "seed": motion.seed, "repeat": motion.repeat},
    )


def _people(scenario: Scenario, motion: Motion) -> dict[str, tuple[int, ...]]:
    """Ids of the people of each group that `sensor.hide` may name; found only where a name is used."""
    if all(hide.group is None for hide in scenario.sensor.hide):
        return {}
    from sim.cast import cast

    parties = cast(scenario, motion.scene, motion.seed, motion.repeat)
    names = {party.name: tuple(m.column + 1 for m in party.members) for party in parties}
    for event, order in zip(scenario.event, _ordered(scenario, motion), strict=True):
        if order is None:
            continue
        if event.type == "merge":
            names[event.into] = order[0]
        elif event.type == "split":
            names |= {part.id: ids for part, ids in zip(event.parts, order, strict=True)}
    return names


def _ordered(scenario: Scenario, motion: Motion) -> list[tuple[tuple[int, ...], ...] | None]:
    """The people after each of the scenario's orders; None for one that never fired."""
    after = {order.id: order.after for order in motion.orders if order.fired is not None}
    return [after.get(event.id) for event in scenario.event]
