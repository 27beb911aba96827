"""Values that no simulation can hold are refused when the scenario is loaded."""

import numpy as np
import pytest

from scenarios import load
from scenarios.errors import InputError
from scenarios.schema.values import Distribution
from sim.rng import draw

OUT_OF_RANGE = [
    "crowd.free_speed=-5", "crowd.free_speed=100", "crowd.free_speed={normal=[-3, 0.2]}", "crowd.height=0",
    "crowd.spacing=-1", "group.a.speed={normal=[0.5, 0.4]}", "group.a.speed=0", "group.a.size=100000",
    "group.a.size={uniform=[10, 9000]}", "camera.fps=1e5", "camera.fps=0.001",
    "camera.image=[8192, 8192]",
    "sensor.clutter_rate=1e5", "world.size=[1e5, 10]", "duration=1e200", "light.sun_azimuth_deg=1e200",
    "crowd.free_speed={normal=[1.3, 0.2], clip=[5, 6]}", "crowd.height={choice=[1.6, 1.7], clip=[1.8, 2]}",
    "lead={uniform=[0, 1], clip=[2, 3]}", "lead={exponential=1, clip=[-2, -1]}",
    "lead={normal=[0, 0], clip=[1, 2]}",
    "group.a.size={poisson=2, clip=[50, 60]}", "group.a.size={poisson=1e5, clip=[1, 1e6]}",
]  # fmt: skip


@pytest.mark.parametrize("setting", OUT_OF_RANGE)
def test_values_out_of_range(setting):
    with pytest.raises(InputError) as error:
        load("merge", set=[setting])
    assert error.value.place


def test_too_much_in_all():
    for settings, word in (
        (["camera.fps=1000", "duration=3000"], "frames"),
        (["camera.fps=100", "duration=3000", "group.a.size=100"], "frames times people"),
        (["group.a.size=2600", "group.b.size=2600"], "up to 5,2.. people"),
    ):
        with pytest.raises(InputError, match=word):
            load("merge", set=settings)


SHARES = [
    {"normal": (1.3, 0.3), "clip": (1, 1.4)}, {"poisson": 3, "clip": (1, 4)}, {"poisson": 3.0},
    {"choice": (1, 2, 2, 5), "clip": (2, 5)}, {"uniform": (0, 4), "clip": (1, 2)}, {"normal": (1, 0)},
    {"exponential": 3.0, "clip": (3, 8)}, {"uniform": (2, 2)}, {"poisson": 900.0}, {"exponential": 0.5},
]  # fmt: skip


@pytest.mark.parametrize("given", SHARES)
def test_shares_are_those_of_the_draws(given):
    made, r = Distribution(**given), np.random.default_rng(0)
    drawn = np.array([draw(made, r) for _ in range(4000)])
    middle = float(np.median(drawn))
    for low, high in ((middle, np.inf), (-np.inf, middle), (0.8 * middle, 1.1 * middle), (middle, middle)):
        assert made.share_within(low, high) == pytest.approx(np.mean((drawn >= low) & (drawn <= high)), abs=0.04)


@pytest.mark.parametrize("events", ["", "event = [5]", "event = [{ type = 3 }]", 'event = "x"'])
def test_unknown_keys_of_distributions(tmp_path, events):
    path = tmp_path / "s.toml"
    group = '{ id = "a", size = 2, start = [4, { uniform = [3, 4], clipp = [3, 4] }], goal = [9, 4] }'
    path.write_text(f"schema = 1\ngroup = [{group}]\n{events}\n")
    with pytest.raises(InputError, match=r"clipp|event"):
        load(path)
    path.write_text(f"schema = 1\n{events}\ngroup = [{{ id = 5, when = {{ tme = 3 }} }}]\n")
    with pytest.raises(InputError):
        load(path)
