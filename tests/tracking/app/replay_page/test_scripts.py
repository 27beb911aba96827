"""The page's scripts, run by node: they decode groups as reported, and project the ground as the camera does."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tracking.app.replay_page
from sim.scene.camera import camera_rotation, project
from sim.store.tables import plain
from sim.store.truth_files import with_ground_height
from sim.types import Camera, Scene, Sequence, Stairs, Tracks
from tests.groups_as_wholes import wholes
from tracking.app.replay_page.page import Run, page_data
from tracking.app.replay_page.pair_columns import pair_columns
from tracking.drawing.layers import SIGMA_99, ellipse
from tracking.grouping.belief import default_belief
from tracking.running.explained_people import explained_people

NODE = shutil.which("node")
HERE = Path(tracking.app.replay_page.__file__).parent
pytestmark = pytest.mark.skipif(NODE is None, reason="no node, which runs the page's scripts here")

EMPTY = dict.fromkeys(("truth", "tracks", "detections", "bounds", "image", "video")) | {"length": 1}


def ran(data: dict, scripts: tuple[str, ...], what: str) -> list:
    """The value of an expression after some of the page's scripts have been read."""
    page = f"const document = {{ getElementById: () => ({{ textContent: {json.dumps(json.dumps(data))} }}) }};"
    page += "const matchMedia = () => ({ matches: false });"
    code = "\n".join([page, *((HERE / name).read_text(encoding="utf-8") for name in scripts)])
    done = subprocess.run(
        [str(NODE), "-"], input=f"{code}\nconsole.log(JSON.stringify({what}));", capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    return json.loads(done.stdout)


@pytest.mark.parametrize("plane", ["ground", "image"])
def test_groups(sequence: Sequence, plane: str) -> None:
    """Place, ellipse, hull and words of every row of a frame."""
    answers = wholes(sequence, plane)
    shown = """[...tracks.rows(60)].map(row => [tracks.id[row], [tracks.x[row], tracks.y[row]],
        extentPoints(tracks, row, (x, y) => [x, y]), tracks.groupRows.hull[row], tracks.groupRows.speed[row],
        groupWords(tracks, row)])"""
    rows = ran(page_data(sequence, [Run(answers)]), ("decode.js", "whole_groups.js"), shown)
    now, near = answers[59], {"atol": 0.05 if plane == "ground" else 3.0}
    assert [row[0] for row in rows] == now.id.tolist()
    for k, (_, at, around, hull, speed, words) in enumerate(rows):
        np.testing.assert_allclose(at, now.pos[k], **near)
        truly = ellipse(now.pos[k], now.groups.extent[k], SIGMA_99)
        for low in (np.min, np.max):
            np.testing.assert_allclose(low(around, axis=0), low(truly, axis=0), **near)
            np.testing.assert_allclose(low(hull, axis=0), low(now.groups.hull[k], axis=0), **near)
        assert speed == pytest.approx(np.hypot(*now.vel[k]), abs=0.51 if plane == "image" else 0.051)
        assert words == f"T{now.id[k]} ≈{round(now.groups.size[k], 1):g}"


@pytest.mark.parametrize("radial", [0.0, 0.3, -0.05])
def test_places_on_the_ground_are_where_the_camera_sees_them(radial: float) -> None:
    """Up and down stairs, through lenses that bend either way, and nowhere behind the camera."""
    up = Stairs(np.array([3.0, 3.0]), np.array([5.0, 4.0]), 3.0, 1.2, 8, 1.5)
    down = Stairs(np.array([8.0, 3.0]), np.array([8.0, 6.0]), 2.0, -1.0, 5, 0.0)
    scene = Scene(np.array([12.0, 12.0]), stairs=(up, down))
    place, turn = np.array([6.0, -8.0, 7.0]), camera_rotation(0.7, 0.1)
    camera = Camera("pinhole", (640, 480), (500.0, 520.0), (320.0, 240.0), place, turn, radial=radial)
    xy = np.random.default_rng(0).uniform([-2, -30], [14, 14], (300, 2))
    uv, _ = project(camera, with_ground_height(xy, scene))
    data = {"camera": plain(camera), "scene": plain(scene)}
    what = f"{json.dumps(xy.tolist())}.map(([x, y]) => project(x, y, heightAt(x, y)) || [null, null])"
    found = np.array(ran(EMPTY | data, ("decode.js", "camera_view.js"), what), float)
    np.testing.assert_array_equal(np.isnan(found), np.isnan(uv))
    seen = np.isfinite(uv[:, 0]) & (np.abs(uv) < 1500).all(axis=1)
    assert 50 < seen.sum() < len(xy)
    np.testing.assert_allclose(found[seen], uv[seen], atol=0.05)


WRITTEN = """(() => {
    const found = [], nothing = () => {}, fillText = (text, x, y) => found.push([x, y]);
    const ctx = { measureText: () => ({ width: 38 }), strokeText: nothing, setLineDash: nothing, fillText };
    const pane = { ctx, width: 100, height: 80, taken: [[0, 0, 50, 20]] };
    placeLabel(pane, "a", () => [[-5, 40]], "red");
    placeLabel(pane, "b", () => [[99, 79]], "red");
    placeLabel(pane, "c", () => [[25, 10], [75, 10]], "red");
    return [found, pane.taken.length, [[-4, 5], [-4, -1]].map(([a, b]) => shownIn(pane, [[a, 3], [b, 4]]))];
})()"""


def test_labels_stay_in_their_pane_and_off_its_title() -> None:
    """Half as wide as 20 px, half as high as 6 px; what lies outside of the pane has no label."""
    places, taken, inside = ran(EMPTY, ("decode.js", "draw.js"), WRITTEN)
    assert places == [[20, 44], [80, 78], [75, 14]]
    assert taken == 4
    assert inside == [True, False]


def test_headings_of_the_timeline_get_the_room_that_they_need() -> None:
    """At least 104 px, at most 150."""
    what = "[['truth', 'blob'], ['truth', 'group-pda'], ['a_tracker_with_a_long_name']].map(words => gutterOf(words))"
    assert ran(EMPTY, ("decode.js", "draw.js", "timeline.js"), what) == [104, 126, 150]


def test_an_error_within_a_tenth_of_a_second_has_one_time() -> None:
    errors = [
        {"side": "tracks", "kind": "ghost", "who": "track 3", "cause": "tracker", "start": 1, "end": b} for b in (1, 40)
    ]
    words = ran(
        EMPTY | {"fps": 10, "errors": errors}, ("decode.js", "draw.js", "timeline.js"), "data.errors.map(errorWords)"
    )
    assert [text.split("  ")[0] for text in words] == ["0.0 s", "0.0–3.9 s"]


def test_errors_are_named_for_a_second_the_latest_two() -> None:
    spans = {"a": (1, 40), "b": (10, 10), "c": (12, 30), "d": (31, 33)}
    errors = [{"side": "tracks", "kind": kind, "start": a, "end": b} for kind, (a, b) in spans.items()]
    data = EMPTY | {"fps": 10, "errors": [*errors, {"side": "other", "kind": "e", "start": 1, "end": 99}]}
    what = "[9, 20, 21, 33, 41, 42, 51].map(f => errorsAt({ name: 'tracks' }, f).map(error => error.kind).join(''))"
    assert ran(data, ("decode.js", "draw.js"), what) == ["a", "cb", "ca", "da", "d", "", ""]


# Of a pair in each of some frames: its probability, whether it is in one group, and the sum and the words of what
# decides; stretches of frames that count as one; the most probable partner.
PAIR = """[10, 60, 100, 130].map(frame => {
    const pairs = pairsOf.truth, stints = stintsOf(pairs, [5, 4]), row = pairRowAt(pairs, stints, frame);
    const { named, rest } = reasonsOf(pairs, stints, row);
    return [pairs.probability[row], inOneGroup(truth, [4, 5], frame), inOneGroupOf(tracks, truth, [4, 5], frame),
        pairs.bias[row] + named.reduce((sum, [value]) => sum + value, rest), named.map(([, words]) => words)];
}).concat([[stretchesOf(1, 9, frame => frame !== 4 && frame < 8), partnersOf(pairsOf.truth, 4)[0][0],
    stintsOf(pairsOf.truth, [4, 99]), pairRowAt(pairsOf.truth, stintsOf(pairsOf.truth, [4, 5]), 9999)]])"""


def test_evidence_about_two_people(sequence: Sequence, tracks: list[Tracks]) -> None:
    """It adds up to the probability, and says what is so."""
    found = explained_people(sequence, None, default_belief())
    data = page_data(sequence, [Run(tracks)]) | {"pairs": {"truth": pair_columns(sequence, None)}}
    *rows, last = ran(data, ("decode.js", "pairs.js"), PAIR)
    for frame, (probability, truly, tracked, total, words) in zip((10, 60, 100, 130), rows, strict=True):
        (row,) = np.flatnonzero((found.a == 4) & (found.b == 5) & (found.step == (frame - 1) // found.size))
        assert probability == pytest.approx(found.probability[row], abs=0.003)
        assert total == pytest.approx(found.log_odds[row], abs=0.5)
        assert truly
        assert tracked
        assert f"{found.values[row, 0]:.1f} m apart" in words
    assert last == [[[1, 3], [5, 7]], 5, [], -1]


def test_words_about_two_people() -> None:
    what = """[...[0.34, -0.34, 0, NaN].map(growthWords), ...[0.3, 0].map(oneWalksWords), ...[1, 0, NaN].map(fileWords),
        ...[-0.4, 0.4, 0].map(shareWords), ...[0.9, 3.3, NaN].map(x => noiseWords("offset", x)),
        ...[0.004, 0.06, 0.31].map(errorOfPositions)]"""
    assert ran(EMPTY, ("decode.js", "pairs.js"), what) == [
        "moving apart by 0.3 m/s", "coming nearer by 0.3 m/s", "their distance hardly changes",
        "their distance hardly changes", "one stands and the other walks, 30 % of the time",
        "both walk, or both stand",
        "in one file with others, as in a queue", "in no file with others",
        "in no file: they stand, or are too far apart", "few people here are mates", "many people here are mates",
        "as many people here are mates as usual", "offset: as mates have it", "offset: 3 times that of mates", "offset",
        "1 cm", "6 cm", "0.3 m",
    ]  # fmt: skip


def test_every_quantity_has_words(sequence: Sequence) -> None:
    data = page_data(sequence, []) | {"pairs": {"truth": pair_columns(sequence, None)}}
    what = """Object.keys(pairsOf.truth.terms).map(name => [name, reasonWords(pairsOf.truth,
        stintsOf(pairsOf.truth, [4, 5]), 0, name)])"""
    found = ran(data, ("decode.js", "pairs.js"), what)
    assert len(found) > 10
    assert all(words != name for name, words in found)


def test_words_about_groups_that_last() -> None:
    """Probability 0.2 and 0.45 at a threshold of 0.4: by the memory of the step before, or by others."""
    what = """[[0.2, true, true], [0.2, false, true], [0.1, true, true], [0.2, false, false], [0.45, false, false],
        [0.45, true, false], [0.55, false, false], [0.45, true, true]].map(
        ([p, before, now]) => heldWords([0.25, 0.1], p, 0.4, before, now)).concat(
        heldWords(null, 0.2, 0.4, true, true))"""
    lasts = "In one group because they were a moment before: it lasts down to 15 %."
    others, apart = "In one group because of its other members.", "Not in one group because of others near them."
    comes = "Not yet in one group: to come into one takes more than 50 %."
    assert ran(EMPTY, ("decode.js", "pairs.js"), what) == [lasts, others, others, "", comes, apart, apart, "", ""]
