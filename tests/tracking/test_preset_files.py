"""What the file of a preset says of each parameter is so, and agrees with the departures that its tracker lists.

The comments of a file are headings; each holds for the parameters below it.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Sequence, Tracks
from tests.processes import ROOT
from tracking.config import PRESETS, Config, presets
from tracking.running.prepare import prepare
from tracking.running.tracker_registry import find, names

OFF, WEAK = "Departures that are off", "Departures that are as weak as their ranges allow"
STAY, IDLE = "Departures that stay, with the default's values", "Without effect with these values"
DEFAULT = (STAY, "Not printed in the paper, with the default's values", "Not in the paper, with the default's values")
FREE = ("Printed in the paper", "Fitted here as in the paper", "Not printed in the paper, fitted here",
        "Not in the paper")  # fmt: skip
HEADINGS = (OFF, WEAK, *DEFAULT, *FREE, IDLE)
FILES = [(tracker, preset) for tracker in names() for preset in presets(tracker)]
METHODS = [tracker for tracker in names() if tracker != "particle"]  # Those with a list of departures of their own.


def headed(tracker: str, preset: str) -> dict[str, str]:
    """The heading of each parameter of a preset's file."""
    found, heading = {}, ""
    for line in (PRESETS / preset / f"{tracker}.toml").read_text(encoding="utf-8").splitlines():
        text = line.removeprefix("# ").partition(":")[0]
        heading = text if line.startswith("# ") and text in HEADINGS else heading
        if line[:1].isalpha() and not line.startswith("tracker ="):
            found[line.partition(" ")[0]] = heading
    return found


def departures(tracker: str) -> list[tuple[bool, set[str]]]:
    """The departures that the tracker's page lists: whether it has a star, and the parameters that it names."""
    page = (ROOT / "docs" / "trackers" / f"{tracker}.md").read_text(encoding="utf-8")
    text = page.partition("## Equations and departures")[2].partition("\n## ")[0]
    known = find(tracker).config_class.params().keys()
    found = re.findall(r"^- (.*?)(?=^- |^$|\Z)", text.partition("\nDepartures")[2], re.DOTALL | re.MULTILINE)
    return [(one.partition(":")[0].endswith("*"), known & set(re.findall(r"`(\w+)`", one))) for one in found]


@pytest.mark.parametrize(("tracker", "preset"), FILES)
def test_values_are_as_their_headings_say(tracker: str, preset: str) -> None:
    kind, of = find(tracker).config_class, headed(tracker, preset)
    values, params = kind.load(preset).as_dict(), kind.params()
    assert {name for name, p in params.items() if values[name] != p.default} <= of.keys()
    assert set(of.values()) <= set(HEADINGS)
    for name, heading in of.items():
        p = params[name]
        assert heading not in DEFAULT or values[name] == p.default, f"{name} has another value"
        assert heading != OFF or values[name] != p.default, f"{name} has the default's value"
        assert heading != WEAK or values[name] in (p.low, p.high), f"{name} is not at an end of its range"


@pytest.mark.parametrize("tracker", METHODS)
def test_the_preset_of_the_paper_has_every_departure(tracker: str) -> None:
    """A star marks departures that stay, in the lists that have stars."""
    listed, of = departures(tracker), headed(tracker, "paper")
    assert len(listed) > 10
    assert set.union(*(params for _, params in listed)) <= of.keys()
    if any(star for star, _ in listed):
        starred, others = (set().union(*(p for star, p in listed if star == kind)) for kind in (True, False))
        assert {of[name] for name in starred - others}.isdisjoint({OFF, WEAK})
        assert {of[name] for name in others}.isdisjoint({STAY})


@pytest.mark.parametrize("tracker", METHODS)
def test_its_file_alone_lists_them(tracker: str) -> None:
    """Neither the lines above the parameters nor the page lists parameters, so that they cannot contradict the file."""
    top = (PRESETS / "paper" / f"{tracker}.toml").read_text(encoding="utf-8").partition("[params]")[0]
    page = (ROOT / "docs" / "trackers" / f"{tracker}.md").read_text(encoding="utf-8")
    text = page.partition("## Presets\n")[2].partition("\n## ")[0]
    assert f"<!-- generated: preset paper/{tracker} -->" in text
    assert [name for name in find(tracker).config_class.params() if f"`{name}`" in top + text] == []


def test_presets_of_relational_share_all_but_what_they_name() -> None:
    table = {"speed_ends", "drift", "diffusion"}
    loaded = {(t, p): find(t).config_class.load(p).as_dict() for t in ("relational", "particle") for p in presets(t)}
    paper = loaded["relational", "paper"]
    for (tracker, preset), values in loaded.items():
        known = {name: paper[name] for name in values}
        changed = {name for name in values if values[name] != known[name]}
        assert changed <= table, f"{tracker}, {preset}"
        assert (preset == "paper") == (not changed)


def answers(tracker: str, config: Config, sequence: Sequence, mode: str) -> list[Tracks]:
    ready = prepare(tracker, sequence, params=config, detections=mode)
    ready.reset(0)
    return [ready.step(frame) for frame in islice(ready.frames(), 10 if mode == "image" else 60)]


SMALL = {"particles": 50, "partitions": 10}
SCENE = ("camera.fps=5", "camera.image=[160,120]")


@pytest.mark.parametrize(("tracker", "preset"), FILES)
def test_parameters_without_effect_have_none(tracker: str, preset: str) -> None:
    """From points or boxes; the time constant of the background also from pictures, but for the slow stereo pairs."""
    idle = [name for name, heading in headed(tracker, preset).items() if heading == IDLE]
    config = find(tracker).config_class.load(preset)
    config = replace(config, **{key: value for key, value in SMALL.items() if key in config.params()})
    pictures = {"background_time"}.intersection(idle) if "pixels" in find(tracker).needs else ()
    for mode, tried in (("file", idle), *([("image", pictures)] if pictures else [])):
        streams = ("left", "background") if mode == "image" else ()
        sequence = simulate(load("merge", SCENE), 9_001, 0, streams)
        before = answers(tracker, config, sequence, mode)
        assert sum(len(t.id) for t in before) > 0
        for name in tried:
            p = config.params()[name]
            for end in {p.low, p.high} - {config.as_dict()[name]}:
                after = answers(tracker, replace(config, **{name: end}), sequence, mode)
                for a, b in zip(before, after, strict=True):
                    assert all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("id", "pos", "vel", "cov")), name
