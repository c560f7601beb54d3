"""Every command block of the documentation is run, and every verb is documented."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(language: str) -> list[tuple[str, str]]:
    """(where, text) of every block of a language."""
    found = []
    for page in PAGES:
        for number, match in enumerate(BLOCK.finditer(page.read_text(encoding="utf-8")), 1):
            if match[1] == language:
                found.append((f"{page.relative_to(ROOT)}-{number}", match[2]))
    return found


def run(command: list[str], folder: Path) -> None:
    verbs = str(Path(sys.executable).parent)
    environment = {**os.environ, "COLUMNS": "100", "PATH": verbs + os.pathsep + os.environ["PATH"]}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=540, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]


def test_known_languages_only() -> None:
    for page in PAGES:
        for match in BLOCK.finditer(page.read_text(encoding="utf-8")):
            assert match[1] in {"bash", "python", "text", "json", "sql"}, f"{page.name}: ```{match[1]} is not tested"


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(("where", "text"), blocks("bash"), ids=lambda value: value if "-" in value[:60] else "")
def test_bash_block(where: str, text: str, tmp_path: Path) -> None:
    make_lines = [line for line in text.splitlines() if line.startswith("make ")]
    for line in make_lines:  # this very test runs inside `make test`: a dry run shows that the verb exists
        run([shutil.which("make") or "make", "-n", *line.split("#")[0].split()[1:]], ROOT)
    rest = "\n".join(line for line in text.splitlines() if line not in make_lines)
    if rest.strip():
        run(["bash", "-euo", "pipefail", "-c", rest.replace(".venv/bin/", "")], tmp_path)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(("where", "text"), blocks("python"), ids=lambda value: value if "-" in value[:60] else "")
def test_python_block(where: str, text: str, tmp_path: Path) -> None:
    script = tmp_path / "block.py"
    script.write_text(text, encoding="utf-8")
    run([sys.executable, "-W", "error", str(script)], tmp_path)


def test_every_verb_is_documented() -> None:
    from typer.main import get_command

    from racecraft.cli.entry import every_verb

    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    for name in get_command(every_verb()).commands:  # type: ignore[attr-defined]
        assert f"racecraft {name}" in text, f"racecraft {name} is not in the documentation"


def test_links_lead_somewhere() -> None:
    for page in [*PAGES, ROOT / "ARCHITECTURE.md"]:
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_the_tree_in_the_readme_is_the_tree() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for folder in sorted((ROOT / "src" / "racecraft").iterdir()):
        if folder.is_dir() and (folder / "__init__.py").exists():
            assert f"src/racecraft/{folder.name}/" in text, f"{folder.name} is missing from the README's tree"
