"""The documentation's pages beside the one in a tab: all of docs/*.md, nothing from elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = ROOT / "build" / "site" / "docs"
LISTED = re.compile(r"^- \[[^\]]+\]\(([^)#]+\.md)\)", re.MULTILINE)
LOADED = re.compile(r"<(?:script|img|source|iframe)\b[^>]*\bsrc=\"([^\"]*)\"|<link\b[^>]*\bhref=\"([^\"]*)\"")


def test_the_table_of_contents_lists_pages_that_are_there_once() -> None:
    listed = LISTED.findall((DOCS / "index.md").read_text(encoding="utf-8"))
    there = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")} - {"index.md"}
    assert len(listed) == len(set(listed)) > 40
    assert set(listed) <= there  # another page stands under "More"


@pytest.mark.skipif(not PAGES.is_dir(), reason="the site is not built: make site")
def test_pages_load_nothing_from_elsewhere_and_run_no_script_of_their_own() -> None:
    pages = list(PAGES.rglob("*.html"))
    assert len(pages) > 40
    for page in pages:
        text = page.read_text(encoding="utf-8")
        loaded = [first or second for first, second in LOADED.findall(text)]
        assert loaded or "_downloads" in page.parts, page  # a sheet to print holds its own style
        assert all(not re.match(r"\w+:|//|/", one) for one in loaded), page  # relative: the folder may lie anywhere
        files = {re.split("[?#]", one)[0] for one in loaded} - {""}
        assert [file for file in files if not (page.parent / file).is_file()] == [], page
        assert "<script>" not in text, page  # the page's policy forbids it under racecraft serve
    styles = "".join(path.read_text(encoding="utf-8") for path in PAGES.rglob("*.css"))
    assert "@import" not in styles
    assert not re.search(r"url\((?!['\"]?data:)['\"]?(\w+:|//)", styles)
