"""Live runs: whether they equal runs of recordings, how fast they are, what they keep in memory and lose.

    python -m benchmarks live equal  [--seeds 20000:20003]
    python -m benchmarks live speed  [--frames 300]
    python -m benchmarks live memory [--boxes 45000] [--pictures 4500]
    python -m benchmarks live kill   [--times 20]
    python -m benchmarks live stream [--minutes 30] [--fps 25]

equal: scenes of `mixed`, 150 frames, of which the first 30 teach the background. Every tracker gets pictures, boxes or
points one by one, and is pickled in the middle; the files of its tracks are compared, byte by byte, with those of
`tracking.track`. speed: pictures of our renderer, the first 50 teach the background and are not timed. Latency is wall
time of `Live.step`; frames per second are of CPU time, with one thread. memory: resident memory at shares of a run in
which ten people at a time walk through the view and go, and new ones come; of pictures, 300 rendered ones are played to
and fro. kill: points of ten people at 10 frames per second go to `flockscope track`, which is killed (SIGKILL) at
random moments; lost is what had been sent until then, and is not in the tracks that are put together afterwards.
stream: pictures of our renderer at a loopback address, tracked by `flockscope track blob` on one core.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np

import tracking
from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import head, row
from benchmarks.support.timing import machine_load
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from sim.pictures.background_sample import BackgroundChoice, GivenSample
from sim.sequence import simulate
from sim.store.track_files import tracks_files
from sim.types import Array, Detections, Frame, Sequence, Tracks
from tracking.app.stored_tracks import find_tracks
from tracking.running.live import Live
from tracking.running.tracker_registry import find, names

LENGTH, LEARNED = 150, 30  # frames of "equal"
WARM = 50  # frames of "speed" that are not timed
SIZES = ((480, 360), (1280, 720))
PLAYED = 300  # rendered pictures of "memory" and "stream"
PEOPLE, WALK = 10, 200  # people at a time, and frames that each is there
SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
Given = dict[str, Any]


def given_of(frame: Frame, kind: str) -> Given:
    """Returns the arguments of `Live.step` for a frame."""
    if kind == "pictures":
        return {"image": frame.image, "right": frame.right}
    d = frame.detections
    assert d is not None
    return {"boxes": d.box, "scores": d.score} if kind == "boxes" else {"points": d.pos, "scores": d.score}


def recording_of(sequence: Sequence, frames: list[Frame], kind: str) -> Sequence:
    """Returns the frames as a recording with pictures, boxes or points alone."""
    choice = BackgroundChoice("learn", LEARNED)
    if kind == "pictures":
        pictures = np.array([frames[k - 1].image for k in choice.indices(LEARNED)])
        frames = [f.replace(detections=None) for f in frames]
        return replace(
            sequence, frames=lambda: iter(frames), length=len(frames), load_background=GivenSample(choice, pictures),
            bare=None, has_detections=False,
        )  # fmt: skip
    alone = [Frame(f.index, f.t, None, None, detections_of(f, kind)) for f in frames]
    return replace(
        sequence, frames=lambda: iter(alone), length=len(frames), has_images=False, has_right=False, bare=None,
        load_background=None,
    )  # fmt: skip


def detections_of(frame: Frame, kind: str) -> Detections:
    d = frame.detections
    assert d is not None
    assert d.box is not None
    if kind == "points":
        return Detections(frame.index, frame.t, "ground", d.pos, None, None, d.score)
    return Detections(frame.index, frame.t, "image", d.box[:, :2] + d.box[:, 2:] / 2, None, d.box, d.score)


def played(live: Live, frames: list[Frame], kind: str) -> list[Tracks]:
    """Returns the completed tracks of a live run, which is pickled in the middle."""
    import pickle

    found = list[Tracks]()
    for frame in frames:
        if frame.index == len(frames) // 2:
            live = pickle.loads(pickle.dumps(live))
        found += live.step(**given_of(frame, kind)).completed
    ended = live.finish().completed
    again = bool(ended) and bool(found) and ended[0].index == found[-1].index
    return [*(found[:-1] if again else found), *ended]


def equal(seeds: range) -> None:
    """Prints how many runs have equal files."""
    head(["tracker", "input", "runs", "equal", "tracks per run"])
    scenes = list[tuple[Sequence, list[Frame]]]()
    for seed in seeds:
        sequence = simulate(load("mixed"), seed, streams=("left", "right"))
        scenes.append((sequence, list(islice(sequence, LENGTH))))
    for name in names():
        for kind in ("pictures", "boxes", "points"):
            same, tracked = list[bool](), list[int]()
            for sequence, frames in scenes:
                try:
                    mode = "image" if kind == "pictures" else "file"
                    run = tracking.track(name, recording_of(sequence, frames, kind), detections=mode)
                except InputError:
                    continue  # the tracker does not take this input
                live = Live(
                    name, fps=sequence.fps, camera=sequence.camera, scene=sequence.scene,
                    image_size=sequence.image_size, background=f"learn:{LEARNED}",
                )  # fmt: skip
                found = played(live, frames, kind)
                one, other = (tracks_files(tracks, fps=sequence.fps) for tracks in (found, run))
                same.append(one == other)
                tracked.append(len({id for t in run for id in t.id.tolist()}))
            if same:
                row([name, kind, f"{len(same)}", f"{sum(same)}", f"{np.mean(tracked):.0f}"])


def rendered(size: tuple[int, int], count: int, right: bool = False) -> tuple[Sequence, list[Frame]]:
    """Returns a scene of `mixed` and so many of its frames, with pictures of this size."""
    scenario = load("mixed", [f"camera.image={list(size)}", f"duration={count / 25 + 5}"])
    sequence = simulate(scenario, 20000, streams=("left", "right") if right else ("left",))
    return sequence, list(islice(sequence, count))


def speed(frames: int) -> None:
    """Prints latency and frame rates."""
    print(f"\n{machine_load()}")
    head(["tracker", "input", "people per frame", "latency, ms: median", "99 %", "frames per second of one core"])
    for size in SIZES:
        sequence, made = rendered(size, WARM + frames, right=True)
        for name in names():
            kinds = [] if size != SIZES[0] else ["boxes"] if "boxes" in find(name).needs else ["points"]
            for kind in (["pictures"] if {"pixels", "stereo"} & {*find(name).needs} else []) + kinds:
                live = Live(
                    name, fps=sequence.fps, camera=sequence.camera, scene=sequence.scene,
                    image_size=sequence.image_size, background=f"learn:{LEARNED}",
                )  # fmt: skip
                latency, people, used = list[float](), list[int](), 0.0
                for frame in made:
                    given = given_of(frame, kind)
                    begun, cpu = time.perf_counter(), time.process_time()
                    now = live.step(**given)
                    if frame.index > WARM:
                        latency.append(1000 * (time.perf_counter() - begun))
                        used += time.process_time() - cpu
                        people.append(0 if now.tracks is None else len(now.tracks.id))
                what = f"{size[0]}×{size[1]} px" if kind == "pictures" else kind
                median, high = np.percentile(latency, [50, 99])
                rate = f"{len(latency) / used:.0f}"
                row([name, what, f"{np.mean(people):.1f}", f"{median:.1f}", f"{high:.1f}", rate])


def places(k: int, wide: float) -> tuple[Array, Array]:
    """Returns the positions (PEOPLE, 2), m, of the people in frame k, and their heights (PEOPLE,), m. Each walks
    through a place 10 m deep and `wide` m wide, then goes, and another one comes."""
    who = np.arange(PEOPLE)
    visit, step = np.divmod(k + who * WALK // PEOPLE, WALK)
    random = np.sin(12.9898 * (who + PEOPLE * visit)) * 43758.5453
    share, depth = step / WALK, 1 + 8 * (random - np.floor(random))
    forth = np.where((who + visit) % 2 == 0, share, 1 - share)
    return np.stack([wide * forth, depth], axis=1), 1.6 + 0.02 * (who % 10)


def boxes(k: int) -> Array:
    """Returns the boxes (PEOPLE, 4), px, of the people in frame k, in a picture of 1280 × 720 px."""
    pos, height = places(k, 20.0)
    foot, scale = 250 + 45 * pos[:, 1], 20 + 9 * pos[:, 1]
    size = np.stack([0.35 * scale, scale], axis=1) * height[:, None]
    return np.hstack([np.stack([64 * pos[:, 0], foot], axis=1) - size * [0.5, 1], size])


def resident(process: int | str = "self") -> float:
    """Returns the resident memory of a process, MB."""
    pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def memory(number: int, pictures: int) -> None:
    """Prints the resident memory of runs over boxes and over pictures."""
    head(["tracker", "input", "frames", *(f"MB after {share:.0%}" for share in SHARES), "from half to end"])
    for name in names():
        if number and "boxes" in find(name).needs:
            _memory(Live(name, fps=25, image_size=(1280, 720)), ({"boxes": boxes(k)} for k in range(number)), number)
    if pictures:
        sequence, made = rendered(SIZES[0], PLAYED)
        to_and_fro = cycle([*made, *made[-2:0:-1]])
        for name in names():
            if "pixels" in find(name).needs:
                live = Live(name, fps=25, camera=sequence.camera, background=f"learn:{LEARNED}")
                _memory(live, ({"image": f.image} for f in islice(to_and_fro, pictures)), pictures)


def _memory(live: Live, frames: Iterator[Given], count: int) -> None:
    at, used = {max(1, round(share * count)) for share in SHARES}, list[float]()
    for k, given in enumerate(frames, 1):
        live.step(**given)
        if k in at:
            used.append(resident())
    what = "pictures" if live.mode == "image" else "boxes"
    grown = used[-1] - used[SHARES.index(0.5)]
    row([str(live.tracker), what, f"{count:,}", *(f"{mb:.0f}" for mb in used), f"{grown:+.1f} MB"])


def track_command(*words: str) -> list[str]:
    return [sys.executable, *(["-S"] if sys.flags.no_site else []), "-m", "tracking.app.cli", "track", *words]


def kill(times: int) -> None:
    """Prints how many seconds are lost by SIGKILL."""
    random, lost, nothing, fps = np.random.default_rng(20000), list[float](), 0, 10
    for _ in range(times):
        with tempfile.TemporaryDirectory() as folder:
            words = track_command("group-pda", "-", "--out", folder + "/run", "--fps", str(fps), "--stream")
            process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            assert process.stdin is not None
            assert process.stdout is not None
            sent = 0
            for k in range(10_000):
                line = json.dumps({"points": places(k, 20.0)[0].tolist()}) + "\n"
                if k == 1:
                    process.stdout.readline()  # the program is loaded
                    begun, end = time.monotonic(), float(random.uniform(1.5, 6.0))
                process.stdin.write(line.encode())
                process.stdin.flush()
                sent = k + 1
                if k and time.monotonic() - begun > end:
                    break
                time.sleep(max(0.0, begun + k / fps - time.monotonic()) if k else 0.0)
            process.kill()
            process.communicate()
            kept = 0
            with suppress(InputError), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                (stored,) = find_tracks(Path(folder) / "run")
                stored.check()
                kept = int(stored.info["frames"])
            lost.append((sent - kept) / fps)
            nothing += kept == 0
    print(f"\n{machine_load()}")
    head(["killed", "seconds lost: median", "most", "nothing kept"])
    row([f"{times} times", f"{np.median(lost):.1f}", f"{max(lost):.1f}", f"{nothing}"])


def send(file: str, port: str, fps: str, seconds: str) -> None:
    """Sends the pictures of a video file again and again to the first reader at a port, at its pace."""
    import av

    with av.open(file) as video:
        packets = [(bytes(p), p.is_keyframe) for p in video.demux(video=0) if p.size]
        template = video.streams.video[0]
        with av.open(f"tcp://127.0.0.1:{port}?listen=1", "w", format="mpegts") as target:
            stream = target.add_stream_from_template(template)
            begun = time.monotonic()
            for k, (content, key) in enumerate(islice(cycle(packets), round(float(fps) * float(seconds)))):
                packet = av.Packet(content)
                packet.stream, packet.time_base = stream, Fraction(1, 90_000)
                packet.pts = packet.dts = round(90_000 * k / float(fps))
                packet.is_keyframe = key
                target.mux(packet)
                time.sleep(max(0.0, begun + k / float(fps) - time.monotonic()))


def stream(minutes: float, fps: float) -> None:
    """Prints what a run on a loopback stream drops, its latency and its memory."""
    import av

    with tempfile.TemporaryDirectory() as folder, socket.socket() as probe:
        video, out = f"{folder}/video.ts", Path(folder, "run")
        _, made = rendered(SIZES[0], PLAYED)
        with av.open(video, "w", format="mpegts") as target:
            coded = target.add_stream("libx264", rate=round(fps), options={"bf": "0", "g": "25"})
            coded.width, coded.height, coded.pix_fmt = *SIZES[0], "yuv420p"
            for frame in made:
                assert frame.image is not None
                target.mux(coded.encode(av.VideoFrame.from_ndarray(frame.image, "bgr24")))
            target.mux(coded.encode())
        probe.bind(("127.0.0.1", 0))
        port, seconds = str(probe.getsockname()[1]), 60 * minutes
        probe.close()
        program = [sys.executable, *(["-S"] if sys.flags.no_site else []), "-m", "benchmarks.live", "send"]
        sender = subprocess.Popen([*program, video, port, str(fps), str(seconds + 30)], stderr=subprocess.DEVNULL)
        time.sleep(5.0)
        words = track_command("blob", f"tcp://127.0.0.1:{port}", "--out", str(out), "--px-per-m", "40", "--json")
        cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {max(cores)})
        process = subprocess.Popen(words, stdout=subprocess.PIPE)
        os.sched_setaffinity(0, cores)
        used = list[float]()
        for _ in range(10):
            time.sleep(seconds / 10)
            used.append(resident(process.pid))
        process.send_signal(signal.SIGINT)
        found = json.loads(process.communicate()[0])
        sender.kill()
        sender.wait()
    (run,) = found["runs"]
    late = run["latency_ms"]
    print(f"\n{machine_load()}")
    memory = ("MB after 10 %", "50 %", "100 %")
    head(["minutes", "frames", "dropped", "lost frames", "reconnects", "latency, ms: median", "99 %", *memory])
    row([
        f"{minutes:g}", f"{run['frames']}", f"{run['dropped_pictures']}", f"{run['lost_frames']}",
        f"{run['reconnects']}", f"{late['median']:.1f}", f"{late['99 %']:.1f}",
        *(f"{used[k]:.0f}" for k in (0, 4, 9)),
    ])  # fmt: skip


def main() -> None:
    if sys.argv[1:2] == ["send"]:
        send(*sys.argv[2:])
        return
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=("equal", "speed", "memory", "kill", "stream"))
    add_seeds(parser, "20000:20003", what="equal: ")
    parser.add_argument("--frames", type=int, default=300, help="speed: frames that are timed")
    parser.add_argument("--boxes", type=int, default=45_000, help="memory: frames of boxes")
    parser.add_argument("--pictures", type=int, default=4_500, help="memory: frames of pictures")
    parser.add_argument("--times", type=int, default=20, help="kill: how often")
    parser.add_argument("--minutes", type=float, default=30.0, help="stream: its length")
    parser.add_argument("--fps", type=float, default=25.0, help="stream: pictures per second")
    args = parser.parse_args()
    modes = {
        "equal": lambda: equal(args.seeds), "speed": lambda: speed(args.frames), "kill": lambda: kill(args.times),
        "memory": lambda: memory(args.boxes, args.pictures), "stream": lambda: stream(args.minutes, args.fps),
    }  # fmt: skip
    modes[args.mode]()


if __name__ == "__main__":
    main()
