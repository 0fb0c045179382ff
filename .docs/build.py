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
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).parent.resolve()
ROOT = DOCS.parent
KEPT = {
    ".md", ".ipynb", ".png", ".svg", ".toml", ".py", ".csv", ".json", ".yml", ".sh",
    ".css", ".js",
}  # fmt: skip


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
        page.write_text(page.read_text() + "".join(_trees(page.read_text())))
    gallery = sources / "runs" / "index.md"
    head, *parts = gallery.read_text().split("\n## ")
    cards = "\n".join(["", "", "{.cards}", *map(_card, parts), ""])
    gallery.write_text("\n## ".join([head + cards, *parts]))


def _trees(text: str) -> Iterator[str]:
    """Yield what lists the pages of a folder beside the text, by group."""
    for part in re.split(r"^## ", text, flags=re.MULTILINE):
        head, _, links = part.partition("\n")
        if pages := re.findall(r"\]\(([\w-]+)\.(?:md|ipynb)\)", links):
            caption = [] if head.startswith("#") else [f":caption: {head}"]
            tree = ["```{toctree}", ":hidden:", *caption, "", *pages, "```"]
            yield "\n" + "\n".join(tree) + "\n"


def _card(part: str) -> str:
    """Return an item that leads to a part of the gallery, with its first picture."""
    title = part.partition("\n")[0]
    anchor = re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")
    picture = re.search(r"^!\[[^\]]*\]\([^)]*\)$", part, re.MULTILINE)
    return f"- [{picture[0] if picture else ''} {title}](#{anchor})"


def main(output: str) -> int:
    """Build, with every warning an error."""
    with tempfile.TemporaryDirectory() as sources:
        gather(Path(sources))
        sphinx = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going"]
        return subprocess.run([*sphinx, sources, output], check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
