"""What each bound of scenarios.limits costs: CPU time and memory of reading an input that lies at the bound.

    python -m benchmarks.limits                  all bounds, as a Markdown table
    python -m benchmarks.limits "frames of tracks" "a picture"

Each input is made and read in a process of its own; making it is not measured. MB: by how much the process grows.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.support.options import new_parser, one_thread
from scenarios import limits

Read = Callable[[], object]


def frames_of_tracks(folder: Path) -> tuple[str, Read]:
    """Two rows of MOT text, the second at the last frame allowed."""
    from sim.io.store.track_files import read_tracks

    path = folder / "t.txt"
    path.write_text(f"1,1,1,1,5,5,1\n{limits.FRAMES},1,1,1,5,5,1\n")
    return f"{limits.FRAMES:,} frames, 2 rows", lambda: read_tracks(path)


def frames_of_a_recording(folder: Path) -> tuple[str, Read]:
    """A MOT folder whose seqinfo.ini states the greatest length; all its frames, and its truth."""
    from sim.io.source import open_source

    (folder / "gt").mkdir()
    (folder / "gt" / "gt.txt").write_text("1,1,1,1,5,5,1,1,1\n")
    (folder / "seqinfo.ini").write_text(f"[Sequence]\nframeRate=25\nseqLength={limits.FRAMES}\n")

    def read() -> None:
        (sequence,) = open_source(folder)
        assert sum(1 for _ in sequence.frames()) == limits.FRAMES
        assert sequence.truth is not None

    return f"{limits.FRAMES:,} frames, 1 row", read


def frames_times_people(folder: Path) -> tuple[str, Read]:
    """A BIWI recording with labelled groups, empty but for its first frames and its last."""
    from sim.io.source import open_source

    people = 20
    last = limits.CELLS // people
    rows = (f"{t} {k} {k}.5 0 {t % 7} 1 0 0\n" for t in (1, 2, 3, last) for k in range(people))
    (folder / "obsmat.txt").write_text("".join(rows))
    (folder / "groups.txt").write_text("1 2\n")
    return f"{last:,} frames × {people} people", lambda: open_source(folder)[0].truth


def rows_of_text(folder: Path) -> tuple[str, Read]:
    """MOT text of the greatest size."""
    from sim.io.formats.mot_table import read_table

    path, line = folder / "t.txt", "{},{},100.00,100.00,50.00,100.00,1,1,1.000\n"
    people = 100
    with path.open("w") as file:
        for k in range(1, limits.FRAMES):
            file.write("".join(line.format(k, p) for p in range(people)))
            if file.tell() > limits.TEXT_BYTES - 6000:
                break
    return f"{limits.TEXT_BYTES:,} bytes", lambda: read_table(path)


def a_json_file(folder: Path) -> tuple[str, Read]:
    """Events of the greatest size of a JSON file."""
    from sim.io.store.group_files import read_events

    path = folder / "e.json"
    event = '{"kind": "merge", "start": 1, "end": 3, "emitted": 2, "before": [1, 2], "after": [2], "members": [1, 2], '
    event += '"pos": [1.5, 2.5]}'
    count = (limits.JSON_BYTES - 100) // (len(event) + 2)
    path.write_text('{"format": 1, "events": [' + ",\n".join([event] * count) + "]}")
    return f"{limits.JSON_BYTES:,} bytes", lambda: read_events(path)


def an_xml_file(folder: Path) -> tuple[str, Read]:
    """A CAVIAR file of the greatest size, with four people in each frame."""
    from sim.io.source import open_source

    people = "".join(f'<object id="{k}"><box h="40" w="20" xc="{30 * k}" yc="60"/></object>' for k in range(4))
    frame = f'<frame number="{{}}"><objectlist>{people}</objectlist><grouplist></grouplist></frame>\n'
    count = (limits.XML_BYTES - 100) // (len(frame) + 5)
    path = folder / "c.xml"
    path.write_text('<dataset name="x">' + "".join(frame.format(k) for k in range(count)) + "</dataset>")
    return f"{limits.XML_BYTES:,} bytes", lambda: open_source(path, fps=25)


def a_toml_file(folder: Path) -> tuple[str, Read]:
    """A scenario of the greatest size: walls."""
    from scenarios import load
    from scenarios.errors import InputError

    walls = ", ".join(f"[{k % 90}, 50, {k % 90 + 1}, 50]" for k in range(limits.TOML_BYTES // 22))[: limits.TOML_BYTES]
    walls = walls[: walls.rindex("]") - 200]
    head = "schema = 1\n" + 'group = [{ id = "a", size = 1, start = [4, 4], goal = [9, 4] }]\nworld.size = [100, 100]\n'
    path = folder / "s.toml"
    path.write_text(f"{head}world.walls = [{walls[: walls.rindex(']') + 1]}]\n")

    def read() -> None:
        try:
            load(path)
        except InputError as error:
            print(error, file=sys.stderr)

    return f"{path.stat().st_size:,} bytes", read


def a_picture(folder: Path) -> tuple[str, Read]:
    """A PNG of the greatest number of pixels."""
    import cv2

    from sim.io.pictures.picture_folder import read_picture

    side = int(limits.PICTURE_PIXELS**0.5)
    path = folder / "p.png"
    cv2.imwrite(str(path), np.zeros((side, side, 3), np.uint8))
    return f"{side} × {side} px", lambda: read_picture(path)


def a_background_sample(folder: Path) -> tuple[str, Read]:
    """A sample of as many of the largest pictures as fit."""
    import cv2

    from sim.io.source import open_source

    side, count = int(limits.PICTURE_PIXELS**0.5), 20
    (folder / "img1").mkdir()
    cv2.imwrite(str(folder / "img1" / "000001.png"), np.zeros((side, side, 3), np.uint8))
    for k in range(2, count + 1):
        (folder / "img1" / f"{k:06d}.png").symlink_to(folder / "img1" / "000001.png")
    return f"{limits.SAMPLE_BYTES:,} bytes", lambda: open_source(folder, fps=10)[0].background()


def detections_of_a_frame(folder: Path) -> tuple[str, Read]:
    """As many detections as one frame may have, compared with as many people."""
    from sim.io.source import open_source
    from sim.io.store.track_files import read_tracks
    from tracking.scoring.evaluation import evaluate

    n = limits.DETECTIONS
    rows = "".join(f"1,{k},{40 * (k % 100)},{90 * (k // 100)},30,80,1,1,1\n" for k in range(n))
    path = folder / "t.txt"
    path.write_text(rows)

    def read() -> None:
        (sequence,) = open_source(path, fps=10)
        truth = sequence.truth
        assert truth is not None
        evaluate(truth, read_tracks(path))

    return f"{n:,} rows", read


def people_of_a_scenario(folder: Path) -> tuple[str, Read]:
    """As many people as a scenario may have, on 200 × 200 m for a second, with detections, without pictures."""
    from scenarios import load
    from sim.sequence import simulate

    path = folder / "s.toml"
    n = limits.PEOPLE
    start = "[{ uniform = [5, 195] }, { uniform = [5, 195] }]"
    path.write_text(
        "schema = 1\nduration = 1.0\nwarmup = 0\nworld.size = [200, 200]\ncamera = { fps = 5, kind = 'top' }\n"
        f'group = [{{ id = "a", size = 1, start = {start}, goal = {start}, repeat = {n} }}]\n'
    )
    return f"{n:,} people, 5 frames", lambda: simulate(load(path), 40_000).truth


def clutter(folder: Path) -> tuple[str, Read]:
    """The greatest rate of false alarms, 100 frames."""
    from scenarios import load
    from sim.sequence import simulate

    sequence = simulate(load("merge", set=["sensor.clutter_rate=1000", "duration=10"]), 40_000)
    return "1,000 a frame, 100 frames", lambda: list(sequence.without_pictures())


def frame_rate(folder: Path) -> tuple[str, Read]:
    """The greatest frame rate, for two seconds."""
    from scenarios import load
    from sim.sequence import simulate

    path = folder / "s.toml"
    path.write_text(
        f"schema = 1\nduration = 2.0\ncamera.fps = {limits.FRAME_RATES[1]}\n"
        'group = [{ id = "a", size = 3, start = [4, 4], goal = [12, 4] }]\n'
    )
    return f"{limits.FRAME_RATES[1]:g} frames/s, 2,000 frames", lambda: simulate(load(path), 40_000).truth


CASES = {
    name.__name__.replace("_", " "): name
    for name in (
        frames_of_tracks, frames_of_a_recording, frames_times_people, rows_of_text, a_json_file, an_xml_file,
        a_toml_file, a_picture, a_background_sample, detections_of_a_frame, people_of_a_scenario, clutter, frame_rate,
    )
}  # fmt: skip


def measure(name: str) -> str:
    """Returns a row of the table: bound, limit, seconds of CPU time, MB."""
    with tempfile.TemporaryDirectory() as folder:
        limit, read = CASES[name](Path(folder))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        began = time.process_time()
        read()
        seconds = time.process_time() - began
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    return f"| {name} | {limit} | {seconds:.1f} | {grown:.0f} |"


def main() -> None:
    """Runs the command."""
    parser = new_parser(__doc__)
    parser.add_argument("names", nargs="*", metavar="BOUND", help=", ".join(CASES))
    parser.add_argument("--here", action="store_true", help="measure one bound in this process")
    given = parser.parse_args()
    if given.here:
        print(measure(given.names[0]), flush=True)
        return
    print("| bound | limit | s | MB |\n|---|---|---|---|", flush=True)
    for name in given.names or CASES:
        subprocess.run([sys.executable, "-m", "benchmarks.limits", "--here", name], check=False)


if __name__ == "__main__":
    one_thread()
    main()
