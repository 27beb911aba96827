"""Nothing is there for show: each scenario key, command option and tracker parameter changes the output."""

from __future__ import annotations

import dataclasses
import re
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.pages.parts import keys_of_scenarios
from scenarios.errors import InputError
from scenarios.loading.toml_files import apply_settings
from scenarios.loading.validation import validate
from scenarios.schema.scenario import Scenario
from sim.store.sequence_folder import sequence_files
from sim.store.track_files import tracks_files
from tests.commands import commands
from tests.processes import FAKE
from tracking import track
from tracking.app.cli import run
from tracking.running import tracker_registry

pytestmark = pytest.mark.slow

# A scene in which every key of the table below has an effect.
SCENE = Path(__file__).with_name("flips.toml").read_text()
TOP = "camera={ kind = 'top', px_per_m = 20, fps = 5 }"
FAR = "group.s.goal=[22, 8]"
LOW = "camera={ height = 3, position = [12, -3] }"
OTHERS = "[{ id = 'c', goal = [4, 12] }, { id = 'd', goal = [16, 11] }]"
SPLIT = f"event.p={{ type = 'split', group = 's', when = {{ time = 7 }}, parts = {OTHERS} }}"
NEAR = "event.p.parts.c.goal=[8, 10]"
STOP = "group.s.stops=[{ at = [13, 13], stay = 2 }]"
SERVED = "event.l.goal=[21, 8]"

# What stands for names and numbers of rows in the keys of settings.
NAMES = {
    r"^group\.\w\.": "group[].", r"^event\.m\.": "event[](merge).", r"^event\.p\.": "event[](split).",
    r"^event\.l\.": "event[](queue).", r"parts\.\w\.": "parts[].", r"(stairs|doors|hide)\.\d\.": r"\1[].",
    r"walls\.\d$": "walls",
}  # fmt: skip


def key_of(setting: str) -> str:
    """The key that a setting sets, as the list of keys has it."""
    path = setting.partition("=")[0]
    for name, key in NAMES.items():
        path = re.sub(name, key, path)
    return path


MEMORY = "sensor.box_noise.memory=[{ share = 0.5, time = 2 }]"
# key: what is set, then what is set instead ("" for nothing; several apart by ";"): the two outputs must differ.
KEYS = {key_of(setting): ("", setting) for setting in (
    "name=other", "duration=10", "warmup=2", "turn_deg=5", "lead=1.5", "mirror=true", "world.size=[25, 20]",
    "world.walls.1=[16.5, 3.2, 18.5, 3.2]", "world.pillars=[[8, 4, 0.3]]", "world.service=[[20, 4]]",
    "world.wall_height=1.0", "world.pillar_height=1.0", "world.stairs.0.foot=[13.5, 14]",
    "world.stairs.0.head=[17, 14]", "world.stairs.0.width=1.0", "world.stairs.0.rise=1.0", "world.stairs.0.steps=5",
    "world.stairs.0.landing=2", "world.stairs.0.slowdown=1", "world.doors.0.at=[9, 18]", "world.doors.0.width=2",
    "camera.image=[320, 240]", "camera.fps=4", "camera.focal_px=400", "camera.baseline=0.2", "camera.tilt_deg=50",
    "camera.yaw_deg=30", "camera.height=25", "camera.position=[12, -14]", "sensor.detect_prob=0.5",
    "sensor.clutter_rate=2", "sensor.box_noise.across=[0, 0.1]", "sensor.box_noise.foot=[0, 0.1]",
    "sensor.box_noise.top=[0, 0.1]", "sensor.box_noise.width=[0, 0.1]", "sensor.box_noise.floor_px=9",
    "sensor.box_noise.scale=2", "sensor.box_noise.occluded=2", "sensor.box_noise.tails=3", "sensor.noise_m=0.2",
    "sensor.box=amodal", "sensor.points=own", "sensor.occlusion_power=4", "sensor.min_visibility=0.9",
    "sensor.small_px=80", "sensor.persistence=0.9", "sensor.hide.0.start=2", "sensor.hide.0.end=4",
    "sensor.hide.0.group=a", "crowd.free_speed=1.0", "crowd.spacing=1.1", "crowd.height=1.6",
    "crowd.slowdown_per_member=0.2", "crowd.sway=0", "crowd.velocity_noise=[0, 0]", "crowd.place_noise=[0, 0]",
    "group.s.size=3", "group.s.start=[11, 14]", "group.s.scatter=0.3", "group.s.via=[[13, 12]]", "group.s.speed=1.7",
    "group.s.enter=2", "group.s.at_goal=leave", "group.q.repeat=3", "event.m.id=n", "event.m.groups=['a', 'b', 's']",
    "event.m.goal=meet", "event.m.via=[[10, 6]]", "event.p.id=n", "event.p.parts.c.size=3",
    "event.p.parts.c.goal=[4, 14]", "event.p.parts.c.via=[[10, 13]]", "event.l.id=n",
    "event.l.groups=['q-1', 'q-2', 'q-3']", "event.l.at=[19, 6]", "event.l.direction_deg=90", "event.l.spacing=1.1",
    "event.l.service=0.2", "event.l.goal=[22, 9]",
)} | {
    "camera.kind": ("", TOP), "camera.px_per_m": (TOP, TOP.replace("20", "15")),
    "camera.crop": (LOW, f"{LOW};camera.crop=true"),
    "sensor.box_noise.memory[].share": (MEMORY, MEMORY.replace("0.5", "0.9")),
    "sensor.box_noise.memory[].time": (MEMORY, MEMORY.replace("2", "1")), "group[].goal": ("", FAR),
    "group[].stops[].at": (STOP, STOP.replace("13]", "12]")),
    "group[].stops[].stay": (STOP, STOP.replace("2 }", "3 }")),
    "group[].stops[].until": (STOP, STOP.replace("2 }", "2, until = [6] }")),
    "group[].stops[].members": (STOP, STOP.replace("2 }", "2, members = 1 }")),
    "event[](merge).at_goal": ("event.p.when.time=11.9", "event.m.at_goal=leave"),
    "event[](split).group": ("", SPLIT),
    "event[](split).parts[].at_goal": (NEAR, f"{NEAR};event.p.parts.c.at_goal=leave"),
    "event[](queue).at_goal": (SERVED, f"{SERVED};event.l.at_goal=stand"),
}  # fmt: skip

# For the merge; one model serves all three orders.
WHEN = {
    "time": ("{ time = 1 }", "{ time = 2 }"),
    "after": ("{ time = 1 }", "{ after = 'p' }"),
    "distance_lt": ("{ distance_lt = 4 }", "{ distance_lt = 9 }"),
    "reach.group": ("{ reach = { group = 'a' } }", "{ reach = { group = 'q-1' } }"),
    "reach.at": ("{ reach = { group = 'a' } }", "{ reach = { group = 'a', at = [6, 4] } }"),
    "reach.radius": ("{ reach = { group = 'a' } }", "{ reach = { group = 'a', radius = 4 } }"),
    "delay": ("{ time = 1 }", "{ time = 1, delay = 1 }"),
}

LAMP = "light.switch=[{ at = 0.2, gain = 0.5 }]"
# What pictures alone are made of: looked for in frame 3, at 0.4 s, without the noise; `right_` in right pictures.
PICTURES = {key_of(setting): ("", setting) for setting in (
    "light.shadow=0.6", "light.penumbra=0.4", "light.drift=0.1", "light.flicker=0.05", "light.cloud=0.2",
    "picture.texture=0.9", "picture.samples=3", "picture.noise=6", "picture.blur_px=1.5", "picture.jpeg=50",
    "picture.shot=1", "picture.foliage=0.3", "picture.right_gain=1.2", "picture.right_roll_deg=1",
    "picture.right_down_px=1",
)} | {
    "light.sun_azimuth_deg": ("light.sun_azimuth_deg=0", "light.sun_azimuth_deg=90"),
    "light.sun_elevation_deg": ("light.sun_elevation_deg=30", "light.sun_elevation_deg=60"),
    "light.drift_time": ("light.drift=0.1", "light.drift=0.1;light.drift_time=2"),
    "light.cloud_size": ("light.cloud=0.2", "light.cloud=0.2;light.cloud_size=2"),
    "light.cloud_speed": ("light.cloud=0.2", "light.cloud=0.2;light.cloud_speed=3"),
    "light.switch[].at": (LAMP, LAMP.replace("0.2", "0.4")),
    "light.switch[].gain": (LAMP, LAMP.replace("0.5", "0.7")),
    "light.switch[].ramp": (LAMP, LAMP.replace("gain", "ramp = 0.6, gain")),
    "picture.sway_px": ("picture.foliage=0.3", "picture.foliage=0.3;picture.sway_px=4"),
    "picture.sway_time": ("picture.foliage=0.3", "picture.foliage=0.3;picture.sway_time=2"),
}  # fmt: skip

# Keys that name things within the file, or say what it is.
TEXT_ONLY = {"schema", "about", "group[].id", "event[](merge).into", "event[](split).parts[].id"}


# Of `sensor`: a detector's measured errors. What each does: tests/sim/detector.
PROFILE = ("false_alarms.", "miss_memory[].", "by_visibility", "true_scores", "false_scores")


@cache
def output(settings: str, seed: int) -> dict[str, bytes] | str:
    """All files of a sequence but the scenario itself and the manifest; or what is refused."""
    import tomllib

    from scenarios.errors import FlockscopeError
    from sim.crowd.world import run as simulate
    from sim.sequence import observe

    table, places = apply_settings({"name": "flip", **tomllib.loads(SCENE)}, settings.split(";") if settings else [])
    try:
        scenario = validate(table, "flip.toml", places, model=Scenario)
        sequence = observe(scenario, simulate(scenario, seed), check=False)
        files = sequence_files(sequence, scenario="", seed=seed)
    except FlockscopeError as error:
        return error.line()
    return {name: body for name, body in files.items() if name not in ("scenario.toml", "manifest.json")}


def differ(before: str, after: str) -> bool:
    """Whether the outputs differ for one of a few seeds (a coin that falls the same way changes nothing)."""
    for seed in (3, 4, 5, 6):
        a, b = output(before, seed), output(after, seed)
        assert isinstance(b, dict), b
        if a != b:
            return True
    return False


def test_every_key_is_in_the_table():
    known = {row["key"] for row in keys_of_scenarios()}
    when = {key for key in known if ".when." in key} | {key for key in known if key.endswith(".type")}
    profile = {key for key in known if key.removeprefix("sensor.").startswith(PROFILE) and key.startswith("sensor.")}
    assert known - when - profile == set(KEYS) | set(PICTURES) | TEXT_ONLY
    assert {key.partition(".when.")[2] for key in when if ".when." in key} == set(WHEN)


@pytest.mark.parametrize("key", KEYS)
def test_a_key_changes_what_is_made(key):
    assert differ(*KEYS[key])


@cache
def three_people():
    """Two seconds of three people, and their camera."""
    from sim.crowd.world import run as simulate
    from sim.scene.camera_placement import place_camera

    scenario = picture_scenario("")
    motion = simulate(scenario, 3)
    return motion, place_camera(scenario.camera, motion)


def picture_scenario(settings: str):
    import tomllib

    few = {**tomllib.loads(SCENE.partition("group = [")[0]), "name": "flip", "duration": 2.0}
    few |= {"group": [{"id": "a", "size": 3, "start": [4, 4], "goal": [12, 4]}]}
    few["camera"]["image"] = [160, 120]
    table, places = apply_settings(few, settings.split(";") if settings else [])
    return validate(table, "flip.toml", places, model=Scenario)


@pytest.mark.parametrize("key", PICTURES)
def test_a_key_changes_pictures_and_only_those(key):
    from sim.render.renderer import Renderer

    before, after = (picture_scenario(settings) for settings in PICTURES[key])
    assert before.model_dump(exclude={"light", "picture"}) == after.model_dump(exclude={"light", "picture"})
    bare = {} if key in ("picture.noise", "picture.shot") else {"noise": 0.0}
    a, b = (
        Renderer(*three_people(), s.light, s.picture.model_copy(update=bare)).draw(3, right=True)
        for s in (before, after)
    )
    of_right = key.startswith("picture.right_")
    assert (a.image != b.image).any() != of_right
    assert (a.right != b.right).any()


@pytest.mark.parametrize("key", WHEN)
def test_a_trigger_changes_what_is_made(key):
    assert differ(*(f"event.m.when={when}" for when in WHEN[key]))


def trackers() -> list[tuple[str, str]]:
    kinds = [(name, getattr(tracker_registry.find(name), "config_class", None)) for name in tracker_registry.names()]
    return [(name, parameter) for name, kind in kinds if kind is not None for parameter in kind.params()]


@cache
def hard_scene():
    """Boxes of a tangle seen from low: misses, false alarms, occlusion, people in and out of view."""
    from scenarios.loading.resolve import load
    from sim.crowd.world import run as simulate
    from sim.sequence import observe

    scene = load("cross", ["group.passers.repeat=6", "camera.tilt_deg=15", "duration=12"])
    sensor = scene.sensor.model_copy(update={"detect_prob": 0.75, "clutter_rate": 2.0, "persistence": 0.6})
    scene = scene.model_copy(update={"sensor": sensor})
    sequence = observe(scene, simulate(scene, 14), check=False)
    return dataclasses.replace(sequence, load_truth=None)


def with_a_covered_picture(sequence):
    """The sequence in memory, without truth; something bright covers the left of its pictures from the 51st on for 2 s,
    which is longer than lost people are kept."""
    frames = list(sequence)
    for k in range(50, 50 + round(2 * sequence.fps)):
        covered = frames[k].image.copy()
        covered[:, :250] = (60, 120, 220)
        frames[k] = dataclasses.replace(frames[k], image=covered)
    sample = sequence.background()
    return dataclasses.replace(sequence, frames=lambda: iter(frames), load_background=lambda: sample, load_truth=None)


@cache
def seen_scene():
    """A few seconds of it as pictures: people share blobs, shadows fall, the light jumps, a hand is before the lens."""
    from scenarios.loading.resolve import load
    from sim.crowd.world import run as simulate
    from sim.sequence import observe

    size = ["camera.image=[320,240]", "camera.tilt_deg=25", "duration=10", "camera.fps=8"]
    light = ["light.shadow=0.5", "light.drift=0.1", "light.drift_time=4.0", "light.switch=[{ at = 5.0, gain = 0.8 }]"]
    scene = load("cross", ["group.passers.repeat=6", *size, *light])
    sequence = observe(scene, simulate(scene, 11), check=False, streams=("left",))
    return with_a_covered_picture(sequence)


@cache
def paired_scene():
    """Pairs of pictures of people near enough that the disparity tells their distance: groups meet, part and cross."""
    from scenarios.loading.resolve import resolve
    from sim.crowd.world import run as simulate
    from sim.sequence import observe

    entries = {e.name: e for e in resolve("subtraction-stereo", ["camera.fps=10", "duration=8"])}
    scene = entries["stereo-crowded"].scenario
    sequence = observe(scene, simulate(scene, 40_003), check=False, streams=("left", "right"))
    return with_a_covered_picture(sequence)


@cache
def scene_with_people_in_its_background():
    """The same pictures; the people of the first one are in the background's sample, and leave."""
    sequence = seen_scene()
    first = next(iter(sequence)).image
    return dataclasses.replace(sequence, load_background=lambda: np.stack([first] * 20))


# Trackers whose output shows the effect of a parameter with fewer particles just as well.
QUICK = {"particle": {"particles": 200}, "relational": {"particles": 200}}


@cache
def answers(name: str, pictures: bool = False, **values: object) -> dict[str, bytes]:
    paired = "pixels" not in tracker_registry.find(name).needs
    seen = scene_with_people_in_its_background if "background" in values else seen_scene
    source = (paired_scene() if paired else seen()) if pictures else hard_scene()
    run = track(name, source, params=QUICK.get(name, {}) | values)
    assert run.info["detections"] == ("image" if pictures else "file")
    return {n: b for n, b in tracks_files(run, fps=source.fps).items() if n != "run.json"}


def accepted(name: str, **values: object) -> bool:
    """Whether a value goes with the defaults of all others."""
    try:
        tracker_registry.find(name).config_class.from_dict(values)
    except InputError:
        return False
    return True


@pytest.mark.filterwarnings("ignore:.*velocity in")
@pytest.mark.parametrize(("name", "parameter"), trackers())
def test_a_parameter_changes_what_a_tracker_says(name, parameter):
    spec = tracker_registry.find(name).config_class.params()[parameter]
    ends = spec.choices or (spec.low, spec.high)
    if isinstance(spec.default, tuple):
        ends = [tuple(2.0 * v for v in spec.default)]
    mode = {"management": "rho"} if spec.meaning.startswith("rho: ") else {}
    others = [value for value in ends if value != spec.default and accepted(name, **{**mode, parameter: value})]
    before, *after = ({**mode, parameter: value} for value in (spec.default, *others))
    assert any(
        answers(name, pictures, **now) != answers(name, pictures, **before)
        for pictures in (False, True)
        for now in after
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("flips")
    (folder / "scene.toml").write_text(SCENE.partition("[[event]]")[0])
    line = ["generate", str(folder / "scene.toml"), "--out"]
    assert run([*line, str(folder / "data"), "--seeds", "40000:40002", "--streams", "none"]) == 0
    small = ["--set", "camera.image=[128,96]", "--set", "duration=3"]
    assert run([*line, str(folder / "seen"), "--seeds", "40000", "--images", "mp4", *small]) == 0
    data = folder / "data" / "flockscope-demo"
    assert run(["track", FAKE, str(data), "--out", str(folder / "tracks")]) == 0
    assert run(["track", FAKE, str(data), "--detections", "truth", "--out", str(folder / "perfect")]) == 0
    one = data / "scene-s40000"
    boxes = [line.split(",") for line in (one / "gt" / "gt.txt").read_text().splitlines()]
    labels = [[*b[:6], "1", "1", "1"] for b in boxes]
    found = [[b[0], "-1", str(float(b[2]) + 6), *b[3:6], "1"] for b in boxes]
    for name, rows in (("gt", labels), ("det", found)):
        (folder / "mot" / name).mkdir(parents=True)
        (folder / "mot" / name / f"{name}.txt").write_text("".join(",".join(row) + "\n" for row in rows))
    assert run(["track", FAKE, str(folder / "mot"), "--fps", "5", "--out", str(folder / "mot-tracks")]) == 0
    shutil.copy(data / "scene-s40000" / "camera.json", folder)
    pair = [f"{k},{i},{20 + 12 * i + k},40,8,20,1" for k in range(1, 16) for i in (1, 2)]
    (folder / "pair.txt").write_text("\n".join([*pair, ""]))
    bare = [f"{k},1,-1,-1,-1,-1,1,{5 + 0.2 * k},4,0" for k in range(1, 16)]
    (folder / "bare.txt").write_text("\n".join([*bare, ""]))
    (folder / "px.csv").write_text("frame,id,x_px,y_px\n1,1,40,80\n2,1,42,80\n")
    (folder / "params.toml").write_text("[params]\nmanagement = 'rho'\nconfirm_ratio = 1.9\n")
    return folder


ONE, SEEN = "{0}/data/flockscope-demo/scene-s40000", "{0}/seen/flockscope-demo/scene-s40000"
SMALL = "generate {0}/scene.toml --seeds 7 --set camera.image=[128,96] --set duration=1 --out {1}"
MOT = "track " + FAKE + " {0}/mot --out {1}"
RUN = f"track blob {ONE} --out {{1}}"
NOISY = RUN + " --detections truth --set sensor.box_noise.scale=4"
SCORED = f"score {ONE} {{0}}/tracks"
IN_IMAGE = "score {0}/mot {0}/mot-tracks --fps 5 --similarity image"
TEXT = "view {0}/mot {0}/mot-tracks/tracks.mot.txt --fps 5 --out {1}/page.html"
OVERLAY = f"overlay {SEEN}/left.mp4 {{0}}/pair.txt --out {{1}}/o.mp4"

# what is run: of each option what is appended, or the words of the line that become others.
FLIPS = {
    "scenarios {0}/scene.toml": {"settings": "--set duration=9", "out": "--out {1}/plan.svg"},
    "scenarios": {"name": "{0}/scene.toml"},
    "generate {0}/scene.toml --seeds 7 --streams none --out {1}": {
        "names": ("{0}/scene.toml", "cross --set camera.fps=5"), "seeds": ("--seeds 7", "--seeds 8"),
        "settings": "--set scenario.duration=3",
    },
    SMALL: {
        "streams": "--streams left,ids", "images": "--images png", "stride": "--stride 2",
        "no_background": "--no-background",
    },
    f"track blob {SEEN}/left.mp4 --px-per-m 12 --out {{1}}": {"background": "--background first:5"},
    RUN: {
        "tracker": ("blob", FAKE), "source": ("40000", "40001"), "params": "--params {0}/params.toml",
        "settings": "--set tracker.gate=0.6", "detections": "--detections truth",
    },
    NOISY: {"seed": "--seed 1"},
    MOT: {"fps": "--fps 5", "px_per_m": "--px-per-m 10", "camera": f"--camera {ONE}/camera.json"},
    "score {0}/data {0}/tracks": {
        "truth": ("{0}/data ", "{0}/data/flockscope-demo/scene-s40001 "), "tracks": ("tracks", "perfect"),
        "group_match": "--group-match members",
    },
    "score {0}/data {0}/tracks --similarity boxes": {"similarity": ("boxes", "ground")},
    SCORED: {"blocks": "--blocks 5"},
    "score {0}/data {0}/tracks {0}/perfect": {"by": "--by HOTA"},
    "score {0}/mot {0}/mot-tracks": {"fps": "--fps 5"},
    IN_IMAGE: {"px_per_m": "--px-per-m 5"},
    f"view {ONE} --out {{1}}/page.html": {"source": ("40000", "40001"), "tracks": "{0}/tracks"},
    "view {0}/mot --out {1}/page.html": {"fps": "--fps 5"},
    TEXT: {"px_per_m": "--px-per-m 20"},
    "view {0}/mot {0}/pair.txt --fps 5 --out {1}/page.html": {"box_scale": "--box-scale 2"},
    "view {0}/mot {0}/mot-tracks --fps 5 --out {1}/page.html": {"camera": "--camera {0}/camera.json"},
    f"view {SEEN} --out {{1}}/page.html": {"video": "--video beside"},
    OVERLAY: {
        "source": ("left.mp4", "background.mp4"), "tracks": ("pair", "bare"), "fps": "--fps 7",
        "px_per_m": "--px-per-m 40", "box_scale": "--box-scale 2",
    },
    OVERLAY.replace("/left.mp4", ""): {"truth": "--truth over"},
    OVERLAY.replace("pair", "bare"): {"camera": f"--camera {SEEN}/camera.json"},
    f"sheet {ONE} --out {{1}}/sheet.png": {"source": ("40000", "40001"), "frames": "--frames 4"},
    f"sheet {SEEN}/left.mp4 {{0}}/pair.txt --out {{1}}/sheet.png": {
        "tracks": ("pair", "bare"), "px_per_m": "--px-per-m 40", "box_scale": "--box-scale 2",
    },
    f"sheet {SEEN}/left.mp4 --out {{1}}/sheet.png": {"fps": "--fps 7"},
    "validate {0}/data": {"folder": ("data", "tracks")},
    "export webdataset {0}/data --out {1}": {
        "folder": ("{0}/data", ONE), "shard_size": "--shard-size 1kB",
    },
    **{
        f"export {form} {{0}}/{source} --out {{1}}": flip
        for form in ("csv", "parquet")
        for source, flip in {
            "data": {
                "source": ("data", "tracks"), "line": "--line a=1,1,2,2", "zone": "--zone a=1,1,2,2,1,2",
                "every": "--every 1s", "start": "--start 0.4", "end": "--end 0.4s", "min_duration": "--min-duration 1h",
            },
            "data --line a=8,0,8,40": {"margin": "--margin 30"},
            "mot": {"fps": "--fps 5"},
        }.items()
    },
    **{
        f"export {form} {{0}}/{source} --out {{1}}": flip
        for form in ("trajnet", "pedpy")
        for source, flip in {"data": {"source": ("data", "tracks")}, "mot": {"fps": "--fps 5"}}.items()
    },
    **{
        f"export {form} {{0}}/px.csv --fps 5 --px-per-m 20 --out {{1}}": {"px_per_m": ("-m 20", "-m 40")}
        for form in ("csv", "parquet", "trajnet", "pedpy")
    },
    "export coco {0}/data --out {1}/c.json": {"folder": ("data", "mot"), "min_visibility": "--min-visibility 1"},
    **{f"export {form} {SEEN} --out {{1}}": {"min_visibility": "--min-visibility 1"} for form in ("yolo", "kitti")},
    f"export webdataset {SEEN} --out {{1}}": {"sample": "--sample frame"},
    f"export webdataset {SEEN} --sample frame --out {{1}}": {
        "seed": "--seed 1", "min_visibility": "--min-visibility 1",
    },
}  # fmt: skip
OPTIONS = {
    (line.removeprefix("export ").split()[0], option): (
        line,
        line.replace(*how) if isinstance(how, tuple) else f"{line} {how}",
    )
    for line, options in FLIPS.items()
    for option, how in options.items()
}
ELSEWHERE = {
    ("generate", "workers"),  # the same bytes for any number: tests/sim/dataset/test_generate.py
    ("track", "workers"),  # as well: test_stored_tracks.py
    ("score", "workers"),
    ("score", "csv"),  # tests/tracking/scoring/test_protocols.py
    ("generate", "cluster"),  # and on a cluster: tests/sim/dataset/test_generate_cluster.py
    ("kitti", "folder"),  # tests/tracking/export/test_kitti.py
    *(("yolo", option) for option in ("folder", "person_class")),  # test_yolo.py beside it
    *(("mots", option) for option in ("folder", "min_visibility")),  # test_mots.py, commands/test_export.py
    ("demo", "quick"),  # the long one is for `make demo`
    ("generate", "sensor"),  # commands/test_fit.py
    ("track", "sensor"),
    ("track", "grouping"),  # commands/test_fit.py
    *(("track", option) for option in ("boxes", "min_score")),  # tests/tracking/recordings/test_detector_boxes.py
    ("track", "step_timeout"),  # tests/tracking/running/test_time_limit.py
    ("view", "by"),  # report/test_in_browser.py
    ("view", "workers"),
    ("view", "belief"),  # replay_page/test_pair_columns_in_browser.py
    # tests/tracking/recordings/test_mot_people.py
    *((name, "person_class") for name in ("coco", "score", "track", "view", "sheet", "overlay")),
    *((name, "person_class") for name in ("csv", "parquet", "trajnet", "pedpy")),
    *((command, "box_scale") for command in ("score", "track")),  # tests/tracking/recordings/test_track_texts.py
}
# Commands whose options are tested one by one in commands/, ../stress, ../errors, and test_*.py here.
OWN = (
    "compare", "errors", "group", "grouping", "joint", "minimize", "relational", "replay", "sensor", "stress", "tune",
)  # fmt: skip


def test_every_option_is_in_the_table():
    known = {(words[-1], param.name) for words, command in commands().items() for param in command.params}
    plain = {(name, option) for name, option in known if name in OWN or option in ("json", "help", "out")}
    assert known - plain | {("scenarios", "out")} == set(OPTIONS) | ELSEWHERE


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("key", OPTIONS, ids=" ".join)
def test_an_option_changes_the_output(key, made, tmp_path, capsys):
    seen = []
    for k, line in enumerate(OPTIONS[key]):
        out = tmp_path / f"out{k}"
        run([word.format(made, out) for word in line.split(" ") if word])
        files = {
            str(p.relative_to(out)): p.read_bytes() for p in out.rglob("*") if p.is_file() and p.name != "run.json"
        }
        output = "".join(capsys.readouterr())
        assert files or output, line
        seen.append((files, "" if files else output))
    assert seen[0] != seen[1]
