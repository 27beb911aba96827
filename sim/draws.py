"""Draws the values of a scenario that are drawn once for each seed where its tables take a fixed value.

Values that are drawn for each person, group or order (scenarios.schema.values) are drawn where these are made.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any

from sim.rng import draw, look_seed, rng

if TYPE_CHECKING:
    import numpy as np

    from scenarios.schema.scenario import Scenario


LOOKS = ("light.", "picture.", "looks.")  # keys of what is seen, not of how people walk: drawn for each scenario anew


def drawn(scenario: Scenario, seed: int, repeat: int = 0) -> Scenario:
    """Returns the scenario of one seed: each value that `scenario.draws` names, drawn from a stream of its own.

    A scenario without draws is returned itself; so is the result, if it is given again. repeat: number of the suite
    entry's copy, 0 without copies. Raises InputError if the drawn values do not fit each other.
    """
    if not scenario.draws:
        return scenario
    from scenarios.loading.draws import link_value, with_values
    from scenarios.loading.validation import validate
    from scenarios.schema.values import Distribution

    def stream(name: str) -> np.random.Generator:
        own = look_seed(seed, scenario.name) if name.startswith(LOOKS) else seed
        return rng(own, "draw", zlib.crc32(name.encode()), repeat=repeat)

    def value(key: str, given: dict[str, Any]) -> Any:
        if "link" in given:
            return link_value(given, named[given["link"]])
        if given.keys() == {"choice"}:
            return given["choice"][int(stream(key).integers(len(given["choice"])))]
        return draw(validate(given, model=Distribution), stream(key))

    named = {name: draw(one, stream(f"draw.{name}")) for name, one in (scenario.draw or {}).items()}
    values = {key: value(key, given) for key, given in scenario.draws.items()}
    return with_values(scenario, values, f"scenario {scenario.name} (seed {seed})")
