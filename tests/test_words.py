"""Plain words: no file has a word of the list."""

from __future__ import annotations

import re
import subprocess

import pytest

from tests.conftest import ROOT

NOT_BUT = {
    r"hang(?:s|ing)? (?:on|together)|hung on": "depends on; correlated",
    r"(?:is|are|be) owed to|\bowes?\b": "contributions; remainder",
    r"\bnobody\b|\bwhom\b": "say who, or turn the sentence",
    r"told apart": "differ significantly",
    r"\banew\b|\bonce more\b": "again",
    r"go(?:es|ing)? on with|gone on with": "resumed; continue",
    r"machines? beyond|beyond (?:a|the|its|each|any|every) limit": "out of limit",
    r"drives? the machines|culprits?|to blame": "main causes",
    r"\bas drawn\b|drawn with": "as specified on the drawing; sampled with",
    r"an(?:other)? one now|are another now|is another now": "have changed",
    r"machines? of (?:one's|your) own": "a custom model",
    r"looked at closely": "responses in focus",
    r"(?-i:\bas Ppk\b)": "equivalent Ppk",
    r"a few machines decide": "dominated by few trials",
    r"effective trials": "effective sample size",
    r"\bfar off\b": "in the outer 5 %",
    r"\blikewise\b|halves alike": "equivalent",
    r"what(?:ever)? no sample|whatever they are like": "for any distribution",
    r"at every look": "anytime-valid",
    r"\bdoubts?\b": "warnings",
    r"likeliest machine": "most probable failure point",
}
SAID = re.compile("|".join(f"(?:{words})" for words in NOT_BUT), re.IGNORECASE)


def files():
    listed = subprocess.run(
        ["git", "ls-files", "tolstat", "runs", "*.md"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return [
        name
        for name in listed.stdout.split()
        if name.endswith((".py", ".md", ".html", ".toml", ".css"))
    ]


@pytest.mark.parametrize("name", files())
def test_words_are_plain(name):
    for number, line in enumerate((ROOT / name).read_text().splitlines(), 1):
        if found := SAID.search(line):
            for words, better in NOT_BUT.items():
                if re.search(words, line, re.IGNORECASE):
                    pytest.fail(f"{name}:{number}: {found[0]!r}; better: {better}")
