"""Scenes beside the suite's, for decisions whose case is rare there: a split, a pillar, a change of light.

`split`: a group of three to five parts in two, with the camera of the suite's `merge`. `pillar`: the suite's `cross`
with a pillar of 0.4 m radius where the groups meet. `light`: the suite's `cross`; from one moment on it is brighter by
half or more.
"""

from __future__ import annotations

from scenarios.loading.resolve import Entry, load

FOLDER = "suites/subtraction-stereo"
START = "[{ uniform = [3, 5] }, { uniform = [5.5, 7] }]"
GROUP = f'{{ id = "ab", size = {{ choice = [3, 4, 5] }}, start = {START}, goal = [11, 7] }}'
PARTS = (
    '[{ id = "a", goal = [{ uniform = [11, 12.5] }, { uniform = [9, 10] }] },'
    ' { id = "b", goal = [{ uniform = [11, 12.5] }, { uniform = [4, 5] }] }]'
)
ORDER = f'{{ id = "s", type = "split", group = "ab", parts = {PARTS}, when = {{ time = {{ uniform = [2, 5] }} }} }}'
SETTINGS = {
    "split": ("merge", (f"group=[{GROUP}]", f"event=[{ORDER}]")),
    "light": ("cross", ("light.switch=[{ at = { uniform = [3, 6] }, gain = { uniform = [1.5, 2.5] } }]",)),
    "pillar": ("cross", ("world.pillars=[[8, 6.8, 0.4]]",)),
}


def further_entries() -> dict[str, Entry]:
    """Returns the scenes by name."""
    return {name: Entry(name, load(f"{FOLDER}/{of}.toml", set)) for name, (of, set) in SETTINGS.items()}
