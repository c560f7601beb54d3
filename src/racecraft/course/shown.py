"""What a lesson's code printed and drew when it ran: kept beside the lesson, so that a page can show it.

    python -m racecraft.course.shown                    # every lesson whose code has changed since
    python -m racecraft.course.shown 4                  # one, whether it has or not
    python -m racecraft.course.shown 4 --language de    # its German pictures alone, where labels.json has changed

`lessons/shown/04_q_table.json` holds a digest of the code and, by the number of the cell of code, what came out of it;
the pictures lie in `lessons/shown/04_q_table/`, those with German words in `lessons/shown/de/04_q_table/`.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import json
import os
import re
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from racecraft.course.lesson import Lesson, find_lesson, lessons
from racecraft.course.percent import Cell
from racecraft.course.phrases import LANGUAGE, label_in
from racecraft.course.quiz import LANGUAGES, Language
from racecraft.course.show import Picture
from racecraft.errors import ConfigError, RacecraftError

WIDEST, WIDEST_FILM = 800, 480  # px
_PICTURE: Final = re.compile(r"^\[picture: (?P<path>.+)\]$")


class Printed(BaseModel):
    """Lines of text."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    kind: Literal["text"] = "text"
    text: str


class Sight(BaseModel):
    """A picture or an animation with words of one language."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    description: str
    """For those who cannot see it."""
    width: int
    height: int


class Drawn(Sight):
    """One with English words, and the same with German ones, where somebody has drawn it."""

    kind: Literal["picture"] = "picture"
    name: str
    german: Sight | None = None


Output = Annotated[Printed | Drawn, Field(discriminator="kind")]


class Shown(BaseModel):
    """A lesson as it ran."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    digest: str = ""
    """Of the code that ran."""
    outputs: dict[int, list[Output]] = Field(default_factory=dict)
    """By the number of the cell of code, from 0."""
    words: list[str] = Field(default_factory=list)
    """What is written on its pictures, in English."""


def shown_path(lesson: Lesson) -> Path:
    """Where it is kept."""
    return lesson.path.parent / "shown" / f"{lesson.path.stem}.json"


def picture_path(lesson: Lesson, name: str, language: Language = "en") -> Path:
    """Where a picture of it is kept."""
    folder = shown_path(lesson).parent
    return (folder if language == "en" else folder / language) / lesson.path.stem / f"{name}.webp"


def read_shown(lesson: Lesson) -> Shown:
    """What came out when the lesson ran; nothing if nobody has kept it, and words alone in a wheel without pictures.

    Raises:
        ConfigError: The file is damaged.
    """
    path = shown_path(lesson)
    try:
        shown = Shown.model_validate_json(path.read_bytes())
    except FileNotFoundError:
        return Shown()
    except (OSError, ValidationError) as error:
        raise ConfigError(f"{path} does not hold what a lesson showed: {' '.join(str(error).split())}") from error
    there = {
        number: [there for one in outputs if (there := _as_there(lesson, one)) is not None]
        for number, outputs in shown.outputs.items()
    }
    return shown.model_copy(update={"outputs": there})


def _as_there(lesson: Lesson, output: Output) -> Output | None:
    """Without a language whose picture is missing."""
    if isinstance(output, Printed):
        return output
    if not picture_path(lesson, output.name).is_file():
        return None
    has_german = picture_path(lesson, output.name, "de").is_file()
    return output if has_german else output.model_copy(update={"german": None})


def digest_of(cells: Iterable[Cell]) -> str:
    """Of the code alone: text may change without running it again."""
    return hashlib.sha256(json.dumps([cell.source for cell in code_of(cells)]).encode()).hexdigest()


def code_of(cells: Iterable[Cell]) -> list[Cell]:
    """The cells of code."""
    return [cell for cell in cells if cell.kind == "code"]


def keep_shown(lesson: Lesson, languages: Sequence[Language] = LANGUAGES) -> Shown:
    """Run a lesson once for each language, and keep what it prints and draws; of German the pictures alone.

    Raises:
        ConfigError: Only German pictures are asked for, and those in English are of other code.
    """
    shown = read_shown(lesson)
    if "en" not in languages and shown.digest != digest_of(lesson.cells()):
        raise _outdated(lesson)
    for language in languages:
        outputs, pictures = _run(lesson, language)
        if language == "en":
            shown = Shown(digest=digest_of(lesson.cells()), outputs=outputs)
        else:
            shown = shown.model_copy(update={"outputs": _with_german(lesson, shown.outputs, outputs)})
        words = {word for picture in pictures.values() for word in picture.words}
        shown = shown.model_copy(update={"words": sorted(words)})
    shown_path(lesson).write_text(shown.model_dump_json(indent=1, exclude_none=True) + "\n", encoding="utf-8")
    return shown


def _outdated(lesson: Lesson) -> ConfigError:
    return ConfigError(
        f"What lesson {lesson.number} showed in English is of other code than it has now.",
        hint=f"First run python -m racecraft.course.shown {lesson.number} without --language.",
    )


def _with_german(
    lesson: Lesson, outputs: dict[int, list[Output]], german: dict[int, list[Output]]
) -> dict[int, list[Output]]:
    drawn = {one.name: one for several in german.values() for one in several if isinstance(one, Drawn)}
    fields = set(Sight.model_fields)

    def paired(one: Output) -> Output:
        if isinstance(one, Printed):
            return one
        if one.name not in drawn:
            raise _outdated(lesson)
        return one.model_copy(update={"german": Sight(**drawn[one.name].model_dump(include=fields))})

    return {number: [paired(one) for one in several] for number, several in outputs.items()}


def _run(lesson: Lesson, language: Language) -> tuple[dict[int, list[Output]], dict[str, Picture]]:
    """What came out, by the number of the cell; and the pictures, by the digest of their files."""
    namespace = dict[str, Any]({"__name__": "__lesson__"})
    outputs: dict[int, list[Output]] = {}
    pictures: dict[str, Picture] = {}
    encoded = Picture.encoded

    def noted(picture: Picture) -> bytes:
        data = encoded(picture)
        pictures[hashlib.sha256(data).hexdigest()] = picture
        return data

    Picture.encoded = noted  # type: ignore[method-assign, assignment]
    os.environ[LANGUAGE] = language
    try:
        for number, cell in enumerate(code_of(lesson.cells())):
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                code = "\n" * (cell.line - 1) + cell.source  # as its lines stand in the file
                exec(compile(code, str(lesson.path), "exec"), namespace)
            if lines := said.getvalue().strip("\n").splitlines():
                outputs[number] = list(_outputs(lesson, language, lines, pictures))
    finally:
        Picture.encoded = encoded  # type: ignore[method-assign]
        del os.environ[LANGUAGE]
    return outputs, pictures


def _outputs(lesson: Lesson, language: Language, lines: list[str], pictures: Mapping[str, Picture]) -> Iterable[Output]:
    text: list[str] = []
    for line in lines:
        found = _PICTURE.match(line)
        if found is None:
            text.append(line)
            continue
        if text:
            yield Printed(text="\n".join(text))
            text = []
        yield _kept(lesson, language, Path(found["path"]), pictures)
    if text:
        yield Printed(text="\n".join(text))


def _kept(lesson: Lesson, language: Language, source: Path, pictures: Mapping[str, Picture]) -> Drawn:
    """A picture as a small WebP file."""
    from PIL import Image, ImageSequence

    target = picture_path(lesson, source.stem, language)
    target.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(source) as image:
        is_film = getattr(image, "n_frames", 1) > 1
        share = min(1.0, (WIDEST_FILM if is_film else WIDEST) / image.width)
        size = round(image.width * share), round(image.height * share)
        frames: list[Any] = [
            frame.convert("RGB").resize(size, Image.Resampling.LANCZOS) for frame in ImageSequence.Iterator(image)
        ]
        options: dict[str, Any] = {"quality": 70, "method": 6}
        if is_film:
            options |= {"save_all": True, "append_images": frames[1:], "loop": 0, "quality": 35}
            options |= {"duration": image.info.get("duration", 100)}
        frames[0].save(target, "WEBP", **options)
    picture = pictures[hashlib.sha256(source.read_bytes()).hexdigest()]
    description = label_in(language, picture.description)
    return Drawn(name=source.stem, description=description, width=size[0], height=size[1])


def main(numbers: list[int], languages: Sequence[Language] = LANGUAGES) -> None:
    """Run lessons in a folder of their own, where nothing that they solve or write stays."""
    wanted = [find_lesson(number) for number in numbers] or [
        lesson for lesson in lessons() if read_shown(lesson).digest != digest_of(lesson.cells())
    ]
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        os.environ["XDG_DATA_HOME"] = folder
        for lesson in wanted:
            sys.argv = [str(lesson.path)]
            shown = keep_shown(lesson, languages)
            print(lesson.path.stem, sum(len(one) for one in shown.outputs.values()), flush=True)  # noqa: T201
        os.chdir("/")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lessons", nargs="*", type=int)
    parser.add_argument("--language", choices=LANGUAGES)
    wanted = parser.parse_args()
    try:
        main(wanted.lessons, (wanted.language,) if wanted.language else LANGUAGES)
    except RacecraftError as error:
        sys.exit(f"{error} {error.hint}".rstrip())
