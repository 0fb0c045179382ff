"""Build the site from the pages where they are: python .docs/build.py OUTPUT.

pip install ".[docs]"

Sphinx wants one folder of sources. So pages, notebooks, pictures and what they link to
are copied beside the configuration, each README as the index of its folder.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent.resolve()
ROOT = DOCS.parent
KEPT = {".md", ".ipynb", ".png", ".svg", ".toml", ".py", ".csv", ".json", ".yml", ".sh"}


def gather(sources: Path) -> None:
    """Copy the files of the repository, and name each README as Sphinx does."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    )  # fmt: skip
    for name in listed.stdout.splitlines():
        path = ROOT / name
        if path.suffix not in KEPT or not path.exists():
            continue
        target = sources / name.removeprefix(".docs/").replace("README.md", "index.md")
        target.parent.mkdir(parents=True, exist_ok=True)
        data = path.read_bytes()
        if path.suffix in (".md", ".ipynb"):
            data = data.replace(b"README.md", b"index.md")
        target.write_bytes(data)
    with (sources / "index.md").open("a") as index:
        index.write((DOCS / "contents.md").read_text())
    for folder in ("runs/tutorial", "runs/how-to"):  # pages in the order of their list
        page = sources / folder / "index.md"
        text = page.read_text()
        pages = re.findall(r"\]\(([\w-]+)\.(?:md|ipynb)\)", text)
        tree = "\n".join(["```{toctree}", ":hidden:", "", *pages, "```"])
        page.write_text(f"{text}\n{tree}\n")


def main(output: str) -> int:
    """Build, with every warning an error."""
    with tempfile.TemporaryDirectory() as sources:
        gather(Path(sources))
        sphinx = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going"]
        return subprocess.run([*sphinx, sources, output], check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
