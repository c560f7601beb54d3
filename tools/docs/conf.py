"""Sphinx's settings: docs/*.md become the pages beside the one in a browser's tab; `make site` runs it.

    docs/index.md, docs/**/*.md ──MyST──▶ *Sphinx, Furo* ──▶ build/site/docs, with a search that needs no server

Nothing is asked of another site, no text of a script stands in a page (its policy may forbid that), and all links are
relative, so that the folder works under any path.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any, Final

project = "Racecraft"
html_title = "Racecraft"
extensions = ["myst_parser"]
root_doc = "index"
exclude_patterns = ["images"]
myst_heading_anchors = 4  # races.md#starts
suppress_warnings = ["misc.highlighting_failure"]  # JSON with dots where more follows
html_theme = "furo"
html_favicon = "../../web/site/public/icon.svg"
html_static_path = ["static"]
html_css_files = ["docs.css"]
html_js_files = [("theme.js", {"priority": 0})]
templates_path = ["templates"]
html_copy_source = html_show_sourcelink = html_show_copyright = False
html_use_index = False
html_sidebars = {
    "**": [f"sidebar/{part}.html" for part in ("brand", "tab", "search", "scroll-start", "navigation", "scroll-end")]
}
html_theme_options: dict[str, Any] = {
    "light_css_variables": {"color-brand-primary": "#a83806", "color-brand-content": "#a83806"},
    "dark_css_variables": {"color-brand-primary": "#ff8a3d", "color-brand-content": "#ff8a3d"},
    "footer_icons": [],
}

SECTION: Final = re.compile(r"^## (.+)$")
PAGE: Final = re.compile(r"^- \[([^\]]+)\]\(([^)#]+)\.md\)")
INLINE: Final = re.compile(r"\s*<script>\s*document\.body\.dataset\.theme.*?</script>", re.DOTALL)
PICTURE: Final = re.compile(r'src="(images/[\w-]+\.\w+)"')
UNUSED: Final = (".buildinfo", "objects.inv")


def add_contents(app: Any, name: str, source: list[str]) -> None:
    """The lists of docs/index.md are the table of contents."""
    if name == root_doc:
        source[0] += contents(source[0], app.env.found_docs - {root_doc})


def contents(index: str, pages: set[str]) -> str:
    """Hidden toctrees of the lists below each heading, and one of the pages that are in none."""
    found: dict[str, list[str]] = {}
    caption = ""
    for line in index.splitlines():
        if heading := SECTION.match(line):
            caption = heading[1]
        elif page := PAGE.match(line):
            found.setdefault(caption, []).append(f"{page[1]} <{page[2]}>")
    listed = {page[2] for line in index.splitlines() if (page := PAGE.match(line))}
    found["More"] = sorted(pages - listed)
    trees = (
        f"\n```{{toctree}}\n:hidden:\n:caption: {name}\n\n" + "\n".join(those) for name, those in found.items() if those
    )
    return "".join(f"{tree}\n```\n" for tree in trees)


def tidy(app: Any, error: Exception | None) -> None:
    """No script in a page, and no file that a reader does not need."""
    if error is not None:
        return
    for page in Path(app.outdir).rglob("*.html"):
        page.write_text(INLINE.sub("", page.read_text(encoding="utf-8")), encoding="utf-8")
    for slides in Path(app.outdir).glob("_downloads/*/*.html"):  # they bring no pictures along
        for picture in PICTURE.findall(slides.read_text(encoding="utf-8")):
            place = slides.parent / picture
            place.parent.mkdir(exist_ok=True)
            shutil.copy(Path(app.srcdir) / picture, place)
    for name in UNUSED:
        (Path(app.outdir) / name).unlink(missing_ok=True)
    shutil.rmtree(Path(app.outdir) / "_sources", ignore_errors=True)


def setup(app: Any) -> None:
    """What Sphinx calls."""
    app.connect("source-read", add_contents)
    app.connect("build-finished", tidy)
