"""A lesson's quiz: questions with several answers, each of which says why it is right or wrong."""

from __future__ import annotations

from typing import Final, Literal, Self

from pydantic import BaseModel, ConfigDict, model_validator

LANGUAGES: Final = ("en", "de")
Language = Literal["en", "de"]


class Words(BaseModel):
    """The same in every language."""

    model_config = ConfigDict(extra="forbid", frozen=True, str_strip_whitespace=True, str_min_length=1)

    en: str
    de: str

    def __getitem__(self, language: str) -> str:
        """In one language; English where there is none of the kind."""
        return self.de if language == "de" else self.en


class Choice(BaseModel):
    """One answer to choose."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    text: Words
    why: Words
    """Why it is right, or what is wrong with it."""
    right: bool = False


class Question(BaseModel):
    """A question with one right answer."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    text: Words
    choices: tuple[Choice, ...]

    @model_validator(mode="after")
    def _has_one_right_answer(self) -> Self:
        if not 2 <= len(self.choices) <= 5 or sum(choice.right for choice in self.choices) != 1:
            raise ValueError(f"{self.text.en!r} needs two to five choices, one of them right")
        return self

    @property
    def answer(self) -> int:
        """Index of the right choice."""
        return next(index for index, choice in enumerate(self.choices) if choice.right)
