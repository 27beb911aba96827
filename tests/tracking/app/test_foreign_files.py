"""No command replaces a file or folder that it did not write, unless the user names that very page or picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.processes import TOY
from tests.recordings import mot_folder
from tests.refusals import refused
from tests.short_scene import write_short_scene
from tracking.app.cli import run


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("foreign")
    write_short_scene(folder, "20000")
    for name in ("walk", "other"):
        rows, ini = "1,1,10,10,20,40,1,1,1\n2,1,12,10,20,40,1,1,1\n", f"name={name}\nframeRate=5\nseqLength=2\n"
        shown = {f"img1/{k:06d}.png": np.full((64, 96, 3), 9 * k, np.uint8) for k in (1, 2)}
        mot_folder(folder / "two" / name, rows, ini=ini, pictures=shown)
    return folder


COMMANDS = {
    "generate": ("generate {0}/scene.toml --seeds 0 --streams none --out {1}", "flockscope-train/scene-s00000/mine"),
    "replay": ("replay {0}/data --streams none --out {1}", "flockscope-test/scene-s20000-s20000/mine"),
    "track": ("track blob {0}/data/flockscope-test/scene-s20000 --out {1}", "groups.csv"),
    "export webdataset": ("export webdataset {0}/data --out {1}", "index.json"),
    "export yolo": ("export yolo {0}/two --out {1}", "data.yaml"),
    "export csv": ("export csv {0}/data --out {1}", "scene-s20000/events.csv"),
    "export parquet": ("export parquet {0}/data --out {1}", "scene-s20000/people.parquet"),
    "export trajnet": ("export trajnet {0}/data --out {1}", "scene-s20000/people.ndjson"),
    "export pedpy": ("export pedpy {0}/data --out {1}", "scene-s20000/people.txt"),
    "tune": ("tune {2} --suite {0}/scene.toml --check none --trials 1 --out {1}/toy.toml", "toy.json"),
    "tune, the front": ("tune {2} --suite {0}/scene.toml --check none --trials 1 --objective DetRe --objective DetPr "
                        "--out {1}/toy.toml", "toy.front-1.toml"),
    "fit sensor": ("fit sensor {0}/data --out {1}/mine.toml", "mine.toml"),
    "view": ("view {0}/two --out {1}", "other.html"),
    "view, the film": ("view {0}/two/walk --video beside --out {1}/walk.html", "walk.view.mp4"),
    "sheet": ("sheet {0}/two --out {1}", "other.png"),
    "overlay": ("overlay {0}/two --out {1}", "other.mp4"),
    "demo": ("demo --quick --out {1}", "index.html"),
}  # fmt: skip


# Of some commands a file that resembles theirs; of all others a JSON text.
LOOKALIKES = {
    "export csv": "kind,start\n",
    "export trajnet": '{"scene": {"id": 0, "p": 1, "s": 780, "e": 810, "fps": 2.5, "tag": [1, []]}}\n',
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_of_others_stays(name: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (line, place), text = COMMANDS[name], LOOKALIKES.get(name, '{"mine": 1}')
    mine = tmp_path / "out" / place
    mine.parent.mkdir(parents=True)
    mine.write_text(text)
    shown = refused(capsys, *[word.format(data, tmp_path / "out", TOY) for word in line.split()])
    assert str(mine.parent) in shown or str(mine) in shown
    assert mine.read_text() == text
    assert [p for p in (tmp_path / "out").rglob("*") if p.is_file()] == [mine]


NO_SECOND = ("replay", "tune", "fit sensor", "demo")


@pytest.mark.parametrize("name", [name for name in COMMANDS if name.split(",")[0] not in NO_SECOND])
def test_own_files_are_replaced(name: str, data: Path, tmp_path: Path) -> None:
    line = [word.format(data, tmp_path / "out", TOY) for word in COMMANDS[name][0].split()]
    assert run(line) == run(line) == 0


@pytest.mark.parametrize("line", ["view {0}/two/walk --video none --out {1}.html", "sheet {0}/two/walk --out {1}.png"])
def test_a_file_that_the_user_names_is_replaced(line: str, data: Path, tmp_path: Path) -> None:
    words = [word.format(data, tmp_path / "mine") for word in line.split()]
    Path(words[-1]).write_text("mine")
    assert run(words) == 0
    assert Path(words[-1]).read_bytes() != b"mine"


def test_a_report_on_several_runs_leaves_what_it_does_not_write(data: Path, tmp_path: Path) -> None:
    for name in ("a/walk.txt", "a/other.txt", "b/walk.txt", "b/other.txt", "out/walk.html"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("1,1,10,10,20,40,1,1,1\n2,1,12,10,20,40,1,1,1\n")
    assert run(["view", str(data / "two"), *(str(tmp_path / run) for run in "ab"), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "walk.html").read_text().startswith("1,1")


@pytest.mark.parametrize(("command", "suffix"), [("overlay", "mp4"), ("sheet", "png"), ("view", "html")])
def test_tracks_of_another_picture_size(
    command: str, suffix: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Boxes in pictures of twice the size are warned of; with --box-scale the file is that of the boxes themselves."""
    for name, scale in (("own", 1), ("other", 2)):
        rows = [f"{f},1,{60 * scale},{20 * scale},{10 * scale},{24 * scale},1\n" for f in (1, 2)]
        (tmp_path / f"{name}.txt").write_text("".join(rows))

    def made(tracks: str, *more: str) -> bytes:
        out = tmp_path / f"a.{suffix}"
        assert run([command, str(data / "two/walk"), str(tmp_path / f"{tracks}.txt"), *more, "--out", str(out)]) == 0
        return out.read_bytes()

    expected = made("own")
    assert "boxes lie beyond" not in capsys.readouterr().err
    assert made("other") != expected
    assert "100% of the boxes lie beyond the pictures of 96 × 64" in capsys.readouterr().err
    assert made("other", "--box-scale", "0.5") == expected
