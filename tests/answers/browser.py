"""A page seen by a browser without a window, and by an HTML parser."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from html.parser import HTMLParser
from importlib.resources import files

BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")


AXE = """onload = async () => {
  for (const svg of document.querySelectorAll("svg")) svg.replaceChildren();
  const found = (await axe.run()).violations.flatMap(rule => rule.nodes.map(node =>
    [rule.id, rule.impact, node.html.slice(0, 200), node.failureSummary]));
  document.body.innerHTML = "<pre></pre>";
  document.querySelector("pre").textContent = JSON.stringify(found);
}"""


def browser():
    """Find a browser; a machine without one cannot say how a page looks."""
    import pytest

    for name in BROWSERS:
        if found := shutil.which(name):
            return found
    return pytest.skip("no Chromium on this machine")


def look(page, folder, *, width=1200, height=1600, dark=False):
    """Return the bytes of a screenshot."""
    target = folder / f"{page.stem}-{width}-{dark}.png"
    scheme = ["--blink-settings=preferredColorScheme=0"] if dark else []
    _call(page, scheme, f"--window-size={width},{height}", f"--screenshot={target}")
    return target.read_bytes()


def printed(page, folder):
    """Return the bytes of the page as it is printed."""
    target = folder / f"{page.stem}.pdf"
    _call(page, [], "--no-pdf-header-footer", f"--print-to-pdf={target}")
    return target.read_bytes()


def scroll_widths(page, folder, widths):
    """Return how wide the page is in a frame of each width, in pixels."""
    found = _asked(
        page, folder, widths, "[innerWidth, document.documentElement.scrollWidth]"
    )
    assert [inner for inner, _ in found] == widths
    return [scroll for _, scroll in found]


def asked(page, folder, width, question, *, paper=False):
    """Ask a page in a frame of a width, in pixels; as it is printed if it is paper."""
    (answer,) = _asked(page, folder, [width], question, paper=paper)
    return answer


def _asked(page, folder, widths, question, *, paper=False):
    """Ask a page in frames of some widths, of one browser.

    A window is never narrower than 500 pixels, a frame is as narrow as one likes.
    """
    probe, frames = folder / "probe.html", folder / "frames.html"
    text = page.read_text(encoding="utf-8")
    if paper:
        text = text.replace("@media print", "@media all")
    script = (
        f"<script>onload = () => parent.postMessage(JSON.stringify({question}), '*')"
        "</script></body>"
    )
    probe.write_text(text.replace("</body>", script), encoding="utf-8")
    frames.write_text(
        "<script>onmessage = e => {"
        " for (const p of document.querySelectorAll('p'))"
        " if (p.nextSibling.contentWindow === e.source) p.textContent = e.data }"
        "</script>"
        + "".join(
            f'<p></p><iframe src="{probe.name}" style="width:{width}px; height:900px; '
            'border:0"></iframe>'
            for width in widths
        )
    )
    shown = _call(frames, [], "--virtual-time-budget=10000", "--dump-dom")
    answers = re.findall(r"<p>(.*?)</p>", shown, re.DOTALL)
    return [json.loads(unescape(answer)) for answer in answers]


def violations(page, folder, *, dark=False):
    """Return what axe-core finds wrong: rule, impact, element, what would help.

    Of a picture it sees the name alone: thousands of lines would take minutes.
    """
    probe = folder / "probe.html"
    text = page.read_text(encoding="utf-8")
    before, _, after = text.rpartition("</body>")
    axe = files("axe_core_python").joinpath("axe.min.js").read_text("utf-8")
    script = f"<script>{axe}</script><script>{AXE}</script></body>"
    probe.write_text(before + script + after, encoding="utf-8")
    scheme = ["--blink-settings=preferredColorScheme=0"] if dark else []
    shown = _call(probe, scheme, "--virtual-time-budget=20000", "--dump-dom")
    (answer,) = re.findall(r"<pre>(.*?)</pre></body>", shown, re.DOTALL)
    return json.loads(unescape(answer))


def _call(page, more, *arguments):
    command = [
        browser(), "--no-sandbox", "--disable-gpu", "--hide-scrollbars", *more,
        *arguments, page.resolve().as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


class Page(HTMLParser):
    """What a test wants to know of a page.

    Attributes
    ----------
    numbers : list of (str, str)
        Full value and text of each number.
    pictures : list of dict
        Attributes of each picture.
    tags, links : list of str
        Of its elements; what it refers to.
    text : str
        All words.
    """

    def __init__(self, text):
        super().__init__()
        self.numbers, self.pictures, self.tags, self.links = [], [], [], []
        self._open = None
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.tags.append(tag)
        if "data-value" in attrs:
            self._open = [attrs["data-value"], ""]
        if tag == "svg":
            self.pictures.append(attrs)
        for key in ("src", "href", "xlink:href"):
            if attrs.get(key):
                self.links.append(attrs[key])

    def handle_endtag(self, tag):
        if self._open and tag == "span":
            self.numbers.append(tuple(self._open))
            self._open = None

    def handle_data(self, data):
        self.text += data
        if self._open:
            self._open[1] += data
