"""Type check of the Python that README and docs show: python -m benchmarks snippets

Writes each block of Python into a file of its own, named as the sentence above says ("Save this as `name.py`") or after
its page, and runs mypy on them, outside the sources as a user does. Exit code 1 if it finds errors.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAMED = r"(?:Save this as `(?P<name>\w+\.py)`[^`]*(?:`\w+`[^`]*)*?\n+)?"
BLOCK = re.compile(NAMED + r"^```python\n(?P<code>.*?)^```", re.M | re.S)

MADE = re.compile(r"<!-- generated: .*?<!-- end -->", re.S)  # signatures


def snippets() -> dict[str, str]:
    """Returns the code of every block by the name of its file."""
    found = {}
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        text = MADE.sub("", page.read_text(encoding="utf-8"))
        for k, block in enumerate(BLOCK.finditer(text)):
            found[block["name"] or f"{page.stem.replace('-', '_').lower()}_{k}.py"] = block["code"]
    return found


def main() -> None:
    """Runs mypy on all blocks."""
    with tempfile.TemporaryDirectory() as folder:
        for name, code in snippets().items():
            (Path(folder) / name).write_text(code, encoding="utf-8")
        options = ["--config-file", str(ROOT / "pyproject.toml"), *sorted(snippets())]
        sys.exit(subprocess.run([sys.executable, "-m", "mypy", *options], cwd=folder).returncode)


if __name__ == "__main__":
    main()
