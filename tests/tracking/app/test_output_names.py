"""A sequence may be called anything: no command writes outside --out, and the name stays what tables show."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

import numpy as np

from sim.store.seal import read_manifest, with_hash
from tests.recordings import mot_folder
from tests.refusals import answer, refused
from tracking.app.cli import run

ROWS = "1,1,10,10,20,40,1,1,1\n2,1,11,10,20,40,1,1,1\n3,1,12,10,20,40,1,1,1\n"
NAMES = ("../../escaped", "{outside}/absolute", "..", "con", "x" * 300, "a/b\\c", "\u202egpj")


def recording(folder: Path, name: str) -> Path:
    shown = {f"img1/{k:06d}.png": np.full((96, 128, 3), 90, np.uint8) for k in (1, 2, 3)}
    return mot_folder(folder, ROWS, ini=f"name={name}\nframeRate=5\n", pictures=shown)


def tree(folder: Path) -> set[str]:
    return {str(p.relative_to(folder)) for p in folder.rglob("*")}


def commands(source: Path, out: Path) -> list[list[str]]:
    tracks = out / "tracks"
    return [
        ["track", "blob", str(source), "--detections", "truth", "--px-per-m", "20", "--out", str(tracks)],
        ["view", str(source), str(tracks), "--video", "beside", "--out", str(out / "pages")],
        ["sheet", str(source), "--out", str(out / "sheets")],
        ["overlay", str(source), str(tracks), "--out", str(out / "films")],
        ["export", "coco", str(source), "--out", str(out / "coco.json")],
        ["export", "parquet", str(source), "--out", str(out / "tables")],
    ]


def test_no_command_leaves_out(tmp_path: Path, capsys) -> None:
    inside = tmp_path / "deep" / "down"
    names = [name.format(outside=tmp_path) for name in NAMES]
    for k, name in enumerate(names):
        recording(inside / "data" / str(k), name)
    before = tree(tmp_path)
    for line in commands(inside / "data", inside / "out"):
        assert run(line) == 0, capsys.readouterr().err
    made = tree(tmp_path) - before
    assert {name for name in made if not name.startswith("deep/down/out")} == set()
    parts = {path.name for path in (inside / "out" / "tracks").iterdir()}
    assert len(parts) == len(names)
    listed = json.loads((inside / "out" / "coco.json").read_text())
    assert all((inside / "data" / image["file_name"]).is_file() for image in listed["images"])
    assert [video["name"] for video in listed["videos"]] == names
    scored = answer(capsys, "score", inside / "data", inside / "out" / "tracks")["sequences"]
    assert [row["name"] for row in scored] == names


LINKED = ("a #1", "b%41 ü", "c?d=e&f;<g>", "--h+'\"i")


def test_links_are_addresses(tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for k, name in enumerate(LINKED):
        recording(Path("data") / str(k), name)
    assert run(["track", "blob", "data", "--detections", "truth", "--px-per-m", "20", "--out", "t"]) == 0
    assert run(["view", "data", "t", "--video", "beside", "--out", "pages"]) == 0
    page = Path("pages/index.html").read_text(encoding="utf-8")
    links = re.findall(r'<th scope="row"><a href="([^"]*)">', page)
    assert len(links) == len(LINKED)
    for link in links:
        parts = urlsplit(unescape(link))
        assert (parts.scheme, parts.query, parts.fragment) == ("", "", ""), link
        shown = Path("pages") / unquote(parts.path)
        assert shown.is_file(), link
        data = re.search(r'"video":({[^}]*})', shown.read_text(encoding="utf-8"))
        assert data is not None
        video = urlsplit(json.loads(data[1])["src"])
        assert (Path("pages") / unquote(video.path)).is_file()
        assert (video.scheme, video.query, video.fragment) == ("", "", "")


def test_a_manifest_names_files_of_its_own_folder_only(tmp_path: Path, capsys) -> None:
    assert run(["generate", "quick", "--seeds", "40000", "--streams", "none", "--out", str(tmp_path / "data")]) == 0
    folder = min((tmp_path / "data" / "flockscope-demo").iterdir())
    manifest = read_manifest(folder)
    shutil.move(folder / "camera.json", tmp_path / "camera.json")
    manifest["files"]["../../../camera.json"] = manifest["files"].pop("camera.json")
    (folder / "manifest.json").write_text(json.dumps(with_hash(manifest)))
    line = refused(capsys, "export", "webdataset", tmp_path / "data", "--out", tmp_path / "out")
    assert "../../../camera.json" in line


def test_a_folder_whose_name_is_no_text(tmp_path: Path, capsys) -> None:
    """Bytes that are no UTF-8: cv2 ended the process when it measured them; pages and COCO files ended as bugs."""
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="replace")  # what is printed is another matter
    name = os.fsdecode(b"caf\xe9")
    for folder in (name, "other"):
        recording(tmp_path / "data" / folder, "")
        (tmp_path / "data" / folder / "seqinfo.ini").unlink()
    for line in commands(tmp_path / "data", tmp_path / "out"):
        assert run([*line, *(["--fps", "5"] if line[0] != "export" else [])]) == 0
    assert {path.name for path in (tmp_path / "out" / "tracks").iterdir()} == {"caf_", "other"}
    videos = json.loads((tmp_path / "out" / "coco.json").read_text())["videos"]
    assert name in [video["name"] for video in videos]
