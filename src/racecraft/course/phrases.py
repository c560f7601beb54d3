"""What the checks of exercises say and what is written on pictures, in a learner's language.

`lessons/de/verdicts.json` and `lessons/de/labels.json` have each sentence in German:

    "It finds {} of {}. ": "Sie findet {} von {}. "

A sentence that ends in a space is one that others go on from. What stands in a gap is translated, too, where the file
has it; a number is written as German numbers are.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from functools import cache
from typing import Final, Literal

from racecraft.course.lesson import lessons_folder
from racecraft.course.quiz import Language

LANGUAGE = "RACECRAFT_LANGUAGE"
"""Of a lesson that runs as a script: a variable of its environment."""

_NUMBER: Final = re.compile(r"[-−]?\d+(,\d{3})*(\.\d+)?(e[-+]?\d+)?( ?%)?")


def learner_language() -> Language:
    """The one that a notebook's name ends in, as JupyterLab tells it, or that a script was started in; else English."""
    notebook = os.environ.get("JPY_SESSION_NAME", "")
    is_german = ".de.ipynb" in notebook if notebook else os.environ.get(LANGUAGE) == "de"
    return "de" if is_german else "en"


def said_in(language: Language, text: str) -> str:
    """A sentence of a check, in a language; as it is where nobody has translated it."""
    return text if language == "en" else Phrases.of(language, "verdicts").translated(text) or text


def label_in(language: Language, text: str) -> str:
    """What is written on a picture, in a language; as it is where nobody has translated it."""
    return text if language == "en" else german_label(text) or text


def german_label(text: str) -> str | None:
    """A number as Germans write it, or a phrase; None where there is no such phrase."""
    if _NUMBER.fullmatch(text):
        return _german_number(text)
    return Phrases.of("de", "labels").translated(text)


class Phrases:
    """Sentences with gaps, and what they are in another language."""

    def __init__(self, catalogue: Mapping[str, str]) -> None:
        longest_first = sorted(catalogue, key=len, reverse=True)  # so that the sentence that says most is taken
        self._phrases = [(_pattern(sentence), catalogue[sentence]) for sentence in longest_first]
        self._beginnings = [phrase for phrase in self._phrases if phrase[1].endswith(" ")]

    @staticmethod
    @cache
    def of(language: Language, kind: Literal["verdicts", "labels"]) -> Phrases:
        """Those of the lessons; none where nobody has written any."""
        path = lessons_folder() / language / f"{kind}.json"
        return Phrases(json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {})

    def translated(self, text: str) -> str | None:
        """A text of one sentence, or of a beginning and another text; None where there is no such sentence."""
        for pattern, other in self._phrases:
            if found := pattern.fullmatch(text):
                return self._filled(other, found.groups())
        for pattern, other in self._beginnings:
            if (found := pattern.match(text)) and (rest := self.translated(text[found.end() :])) is not None:
                return self._filled(other, found.groups()) + rest
        return None

    def _filled(self, sentence: str, gaps: tuple[str, ...]) -> str:
        parts = sentence.split("{}")
        return "".join(
            part + (self._gap(gaps[number]) if number < len(gaps) else "") for number, part in enumerate(parts)
        )

    def _gap(self, text: str) -> str:
        numbers = text.split(", ")
        if all(map(_NUMBER.fullmatch, numbers)):
            return ("; " if "." in text else ", ").join(map(_german_number, numbers))
        return self.translated(text) or text


def _german_number(text: str) -> str:
    return text.translate(str.maketrans(".,", ",."))


def _pattern(sentence: str) -> re.Pattern[str]:
    return re.compile("(.*?)".join(map(re.escape, sentence.split("{}"))), re.DOTALL)
