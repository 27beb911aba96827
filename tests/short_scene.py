"""A scene of two people for two seconds, as a file, and a stored dataset of it, for tests of the command line."""

from pathlib import Path

from tracking.app.cli import run

SCENE = """
schema = 1
duration = 2.0
warmup = 0.0
camera = { fps = 5 }
group = [{ id = "a", size = 2, start = [4, 4], goal = [12, 4] }]
"""


def write_short_scene(folder: Path, seeds: str) -> None:
    """Writes folder/scene.toml, and folder/data with a sequence of it for each of the seeds, without pictures."""
    (folder / "scene.toml").write_text(SCENE)
    line = ["generate", str(folder / "scene.toml"), "--seeds", seeds, "--streams", "none"]
    assert run([*line, "--out", str(folder / "data")]) == 0
