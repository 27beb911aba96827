"""Whole inputs of every kind, which the readers accept: small texts written here, and files that the commands made."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tests.small_videos import write_video

if TYPE_CHECKING:
    from tracking.tuning.search_plan import SearchPlan

GROUP = '[[group]]\nid = "a"\nsize = 2\nstart = [4, 4]\ngoal = [12, 4]\nrepeat = 1\n'
SCENARIO = f"""schema = 1
name = "small"
duration = 1.0
warmup = 0.4
turn_deg = 0
mirror = false
[world]
size = [16, 10]
walls = [[0, 9, 16, 9]]
doors = [{{ at = [8, 9], width = 1.2 }}]
pillars = [[2, 2, 0.3]]
stairs = [{{ foot = [14, 5], head = [15.5, 5], rise = 0.5, steps = 3 }}]
[camera]
fps = 5
image = [64, 48]
focal_px = 60.0
[crowd]
free_speed = {{ normal = [1.34, 0.26], clip = [0.5, 2.2] }}
height = {{ uniform = [1.5, 1.9] }}
[sensor]
detect_prob = 0.9
clutter_rate = 0.3
hide = [{{ start = 0.2, end = 0.5, group = "a" }}]
[light]
shadow = 0.2
[picture]
noise = 2.0
{GROUP}
[[group]]
id = "b"
size = {{ poisson = 1.1, clip = [1, 3] }}
start = [12, {{ uniform = [5, 6] }}]
goal = [4, 4]
speed = 1.2
enter = 0.1
[[event]]
id = "m"
type = "merge"
groups = ["a", "b"]
into = "ab"
when = {{ time = 0.5, delay = 0.1 }}
[[event]]
id = "p"
type = "split"
group = "ab"
when = {{ reach = {{ group = "ab", at = [8, 4], radius = 1.0 }} }}
parts = [{{ id = "c", size = 1, goal = [4, 2] }}, {{ id = "d", goal = [9, 3] }}]
"""
SIMULATED = SCENARIO[: SCENARIO.index("[[event]]")]
MADE = f"schema = 1\nduration = 1.0\ncamera = {{ fps = 5, image = [64, 48], focal_px = 60.0 }}\n{GROUP}"
SUITE = 'about = "x"\nentry = [{ name = "e", scenario = "merge", set = ["duration=9"], repeat = 2 }]\n'
SENSOR = """schema = 1
[sensor]
detect_prob = 0.9
by_visibility = [0.0, 0.5, 1.0]
true_scores = [0.1, 0.5, 0.9]
box_noise = { across = [0.0, 0.1], tails = 3, memory = [{ share = 0.5, time = 2.0 }] }
false_alarms = { life = 1.0, seen = 0.9, at = [[0.1, 0.2], [0.3, 0.4]] }
miss_memory = [{ share = 0.5, time = 1.0 }]
"""
OBSERVATION = (
    "schema = 1\n[camera]\nfps = 5\nheight = 5\nposition = [1, 2]\n[light]\nshadow = 0.1\n[sensor.box_noise]\nscale=1\n"
)
PARAMS = 'tracker = "blob"\n\n[params]\ngate = 0.99\n'
CAVIAR = """<?xml version="1.0" encoding="UTF-8"?>
<dataset name="walk">
<frame number="0"><objectlist><object id="0"><orientation>90</orientation><box h="40" w="20" xc="50" yc="60"/>
<hypothesislist><hypothesis><movement>walking</movement></hypothesis></hypothesislist></object>
<object id="1"><box h="41" w="21" xc="80" yc="61"/></object></objectlist>
<grouplist><group id="2"><members>0,1</members></group></grouplist></frame>
<frame number="1"><objectlist><object id="0"><box h="40" w="20" xc="51" yc="60"/></object>
<object id="1"><box h="41" w="21" xc="81" yc="61"/></object></objectlist>
<grouplist><group id="2"><members>0,1</members></group></grouplist></frame>
</dataset>
"""
TSAI = """<?xml version="1.0" encoding="UTF-8"?>
<Camera name="View_001">
<Geometry width="768" height="576" ncx="795" nfx="752" dx="0.00485" dy="0.00465" dpx="0.00512" dpy="0.00465"/>
<Intrinsic focal="5.549" kappa1="0.0051" cx="324.2" cy="282.5" sx="1.0937"/>
<Extrinsic tx="-0.0549" ty="-5.7" tz="33.5" rx="1.77" ry="0.46" rz="0.04"/>
</Camera>
""".replace('tx="-0.0549" ty="-5.7" tz="33.5"', 'tx="-4785.17" ty="2609.96" tz="34253.27"').replace(
    'rx="1.77" ry="0.46" rz="0.04"', 'rx="1.9007" ry="0.4966" rz="0.1524"'
)
CAMERA = (
    '{"format": 1, "kind": "pinhole", "image": [64, 48], "focal_px": [60, 60], "centre_px": [32, 24], "position": '
    '[1, 2, 5], "rotation": [[1, 0, 0], [0, -0.8, -0.6], [0, 0.6, -0.8]], "baseline": 0.1, "px_per_m": null}'
)
PAIR = """%YAML:1.0
---
image_width: 64
image_height: 48
P1: !!opencv-matrix
   rows: 3
   cols: 4
   dt: d
   data: [ 60., 0., 31.5, 0., 0., 60., 23.5, 0., 0., 0., 1., 0. ]
P2: !!opencv-matrix
   rows: 3
   cols: 4
   dt: d
   data: [ 60., 0., 31.5, -6., 0., 60., 23.5, 0., 0., 0., 1., 0. ]
rotation: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., -0.8, -0.6, 0., 0.6, -0.8 ]
position: [ 1., 2., 5. ]
"""
SEQINFO = "[Sequence]\nname=walk\nimDir=img1\nframeRate=10\nseqLength=4\nimWidth=64\nimHeight=48\nimExt=.png\n"
ROWS = "".join(f"{f},{i},{10 * i + f},10,8,20,1,1,0.9\n" for f in (1, 2, 3, 4) for i in (1, 2))
TEN = "".join(f"{f},{i},{10 * i + f},10,8,20,0.9,{i}.5,2.25,0\n" for f in (1, 2, 3, 4) for i in (1, 2))
DETECTIONS = "".join(f"{f},-1,{10 * i + f},10,8,20,0.9,{i}.5,2.25,0\n" for f in (1, 2, 3, 4) for i in (1, 2))
OBSMAT = "".join(f"{f} {i} {i}.5 0 {f / 10} 1.0 0 0.1\n" for f in (1, 11, 21, 41) for i in (1, 2, 3))
NDJSON = '{"scene": {"id": 0, "p": 1, "s": 10, "e": 40, "fps": 2.5, "tag": [1, []]}}\n' + "".join(
    f'{{"track": {{"f": {f}, "p": {i}, "x": {i}.5, "y": {f / 10}}}}}\n' for f in (10, 20, 40) for i in (1, 2)
)
ETH = "".join(f"{f}.0\t{i}.0\t{i}.5\t{f / 10}\n" for f in (10, 20, 40) for i in (1, 2))
PEDPY = "# framerate: 8.00\n# id frame x/m y/m z/m\n" + "".join(
    f"{i} {f} {i}.5 {f / 10} 0\n" for i in (1, 2) for f in (0, 1, 2)
)
LABELLED = "frame,id,x_m,y_m,group,mood\n" + "".join(f"{f},{i},{i}.5,{f / 10},1,\n" for f in (1, 2) for i in (1, 2))
EVENTS = (
    '{"format": 1, "events": [\n{"kind": "merge", "start": 1, "end": 3, "emitted": 2, "before": [-1, 2], "after": [2], '
    '"members": [1, 2], "pos": [1.5, null], "frame": 2}\n]}\n'
)
GROUPS_CSV = 'frame,group,members,x,y,hull,size\n1,1,1 2,1.0,2.0,"POLYGON ((0 0, 1 0, 1 1, 0 0))",2\n2,1,1 2,,,,2\n'
NEAR = "start,end,a,b\n1,3,1,2\n2,4,2,3\n"
SCRIPT = (
    '{"format": 1, "orders": [\n{"id": "m", "kind": "merge", "fired": 2, "before": [[1], [2]], "after": [[1, 2]], '
    '"event": 0}\n]}\n'
)
SCENE = (
    '{"format": 1, "size": [16, 10], "walls": [[[0, 1], [2, 3]]], "pillars": [[1, 2, 0.3]], "doors": [], "service": '
    '[[1, 2]], "stairs": [{"foot": [1, 1], "head": [3, 1], "width": 2, "rise": 1, "steps": 5, "landing": 1}], '
    '"wall_height": 2.5, "pillar_height": 2.5}'
)
TEXTS: dict[str, dict[str, str]] = {
    "scenario": {"scene.toml": SCENARIO},
    "simulated scenario": {"scene.toml": SIMULATED},
    "extended scenario": {"scene.toml": 'extends = "merge.toml"\nduration = 14.0\ngroup = [{ id = "a", size = 3 }]\n'},
    "suite": {"suite.toml": SUITE},
    "setting": {"setting.txt": "group.a.size={ uniform = [1, 3] }"},
    "tracker setting": {"setting.txt": "tracker.gate=0.95"},
    "parameters": {"params.toml": PARAMS},
    "sensor profile": {"sensor.toml": SENSOR},
    "observation": {"view.toml": OBSERVATION},
    "camera json": {"camera.json": CAMERA},
    "camera xml": {"camera.xml": TSAI},
    "camera yaml": {"pair.yml": PAIR},
    "biwi": {"obsmat.txt": OBSMAT, "groups.txt": "1 2\n3\n"},
    "caviar": {"walk.xml": CAVIAR},
    "mot": {"seqinfo.ini": SEQINFO, "gt/gt.txt": ROWS, "det/det.txt": DETECTIONS},
    "mot text": {"people.txt": TEN},
    "trajnet": {"walk.ndjson": NDJSON},
    "eth": {"walk.txt": ETH, "walk.groups.txt": "1 2\n"},
    "pedpy": {"walk.txt": PEDPY},
    "labelled text": {"people.csv": LABELLED},
    "tracks text": {"tracks.txt": TEN, "groups.csv": GROUPS_CSV, "events.json": EVENTS},
    "events": {"events.json": EVENTS},
    "groups": {"groups.csv": GROUPS_CSV},
    "near": {"near.csv": NEAR},
    "script": {"script.json": SCRIPT},
    "scene": {"scene.json": SCENE},
}
"""Content of the files of each kind of input, by name of the file."""


def write_specimens(root: Path) -> dict[str, Path]:
    """Writes all whole inputs below the folder `root`; returns the folder of each, by kind.

    Besides the texts these are: pictures, video, dataset (a stored sequence), run (stored tracks), study (of `tune`).
    """
    return write_texts(root) | _pictures(root) | _made(root) | {"study": _study(root / "study")}


def write_texts(root: Path) -> dict[str, Path]:
    """Writes the inputs of TEXTS below the folder `root`; returns the folder of each, by kind."""
    found = {}
    for kind, files in TEXTS.items():
        found[kind] = root / kind.replace(" ", "-")
        for name, text in files.items():
            path = found[kind] / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    return found


def _pictures(root: Path) -> dict[str, Path]:
    import cv2

    pictures, video = root / "pictures", root / "video"
    (pictures / "img1").mkdir(parents=True)
    video.mkdir()
    images = [np.random.default_rng(k).integers(0, 255, (48, 64, 3), np.uint8) for k in range(4)]
    for k, (image, suffix) in enumerate(zip(images, ("png", "jpg", "bmp", "tif"), strict=True), 1):
        cv2.imwrite(str(pictures / "img1" / f"{k:06d}.{suffix}"), image)
    (pictures / "seqinfo.ini").write_text(SEQINFO, encoding="utf-8")
    return {"pictures": pictures, "video": _video(video, images)}


def _video(folder: Path, images: list[np.ndarray]) -> Path:
    for name, codec in (("walk.mp4", "libx264"), ("walk.avi", "mjpeg"), ("walk.mkv", "mpeg4")):
        write_video(folder / name, images, codec=codec, pix_fmt="yuvj420p" if codec == "mjpeg" else "yuv420p")
    return folder


def _made(root: Path) -> dict[str, Path]:
    """Runs `generate` and `track` and returns the folders of the sequence and of its tracks."""
    from tracking.app.cli import run

    scene, data, runs = root / "made.toml", root / "data", root / "runs"
    scene.write_text(MADE, encoding="utf-8")
    more = ["--streams", "left,ids,disparity", "--images", "png"]
    assert run(["generate", str(scene), "--seeds", "40000", "--out", str(data), *more]) == 0
    (sequence,) = [path.parent for path in data.rglob("manifest.json")]
    track = ["track", "group-pda", str(sequence), "--detections", "file", "--out", str(runs)]
    assert run(track) == 0
    (tracks,) = [path.parent for path in runs.rglob("tracks.parquet")]
    return {"dataset": Path(shutil.move(sequence, root / "dataset")), "run": Path(shutil.move(tracks, root / "run"))}


def study_plan() -> SearchPlan:
    """Returns the plan of the search whose study is damaged; its trials are never played."""
    from tracking.tuning.options import TuneOptions
    from tracking.tuning.search_plan import search_plan

    seeds = {"seeds": range(2), "validation": range(10_000, 10_002), "test": range(20_000, 20_002)}
    return search_plan(TuneOptions(tracker="blob", suite="merge", check="split", trials=4, objective="HOTA", **seeds))


def _study(folder: Path) -> Path:
    from tracking.tuning.study import open_study

    folder.mkdir()
    with open_study(study_plan(), folder / "study.journal", "damaged") as study:
        for value in (0.1, 0.2, 0.3):
            asked = study.ask()
            assert asked is not None
            study.tell(asked, [value])
    return folder
