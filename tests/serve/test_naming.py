"""What people may call themselves and their things, in any script, and what would harm the text beside it."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from racecraft.errors import ConfigError
from racecraft.serve.groups.schemas import NewGroup
from racecraft.serve.naming import plain_text
from racecraft.serve.people.names import checked_name, handle_of
from racecraft.serve.people.people import People, add_person
from racecraft.serve.problems import Conflict, NotFound
from racecraft.serve.store.database import Database

HONEST = [
    *(
        "Zoë",
        "Nguyễn Thị Hồng",
        "محمّد",
        "مُحَمَّد",
        "شَرِيف",
        "अनुष्का",
        "श्रीकृष्ण",
        "ज़्यादा",
        "สมชัยน้ำ",
        "שָׁלוֹם",
        "李小龍",
        "김민준",
    ),
    *(
        "ශ්\u200dරී",
        "می\u200cنا",
        "ကျွန်ုပ်",
        "བོད་",
        "Ærøskøbing 7",
        "O'Neil-Смит"[:6],
        "Ada 🏎\ufe0f",
        "Team 👩\u200d🔬",
        "👩🏽\u200d🚀 Mae",
    ),
]
ZALGO = "A" + "".join(chr(0x300 + i) for i in range(8)) + "da"
HARMFUL = {
    "accents piled up": (ZALGO, "accents"),
    "a mark many times": ("ก" + "็" * 6, "accents"),
    "turned around": ("\u202eadA", "turns the text"),
    "isolated": ("\u2066Ada\u2069", "nobody sees"),
    "a joiner": ("A\u200dda", "nobody sees"),
    "a non-joiner": ("Ad\u200ca", "nobody sees"),
    "a joiner at the end": ("Ada👩\u200d", "nobody sees"),
    "a soft hyphen": ("A\u00adda", "nobody sees"),
    "a grapheme joiner": ("A\u034fda", "nobody sees"),
    "an empty braille": ("Ada\u2800", "nobody sees"),
    "a selector of ideographs": ("李\U000e0100", "nobody sees"),
    "a tag": ("Ada\U000e0041", "nobody sees"),
    "a line in one sign": ("Ada\ufdfd", "wide"),
    "a blessing in one sign": ("Ada\ufdfa", "wide"),
    "cuneiform": ("Ada\U00012031", "wide"),
}


@pytest.mark.parametrize("name", HONEST)
def test_honest_names_are_names(name: str) -> None:
    assert plain_text(name)
    assert checked_name(name)
    assert handle_of(name)


@pytest.mark.parametrize(("name", "why"), HARMFUL.values(), ids=HARMFUL)
def test_what_harms_the_text_beside_it_is_no_name_and_no_title(name: str, why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        checked_name(name)
    with pytest.raises(ValidationError, match=why):
        NewGroup(title=name)


def test_titles_are_on_one_line() -> None:
    assert NewGroup(title=" Our\n cup  7 ").title == "Our cup 7"
    with pytest.raises(ValidationError):
        NewGroup(title=" \n ")


@pytest.mark.parametrize("name", ["(gone {})", "(Gone {})", "（gone {}）", "gone{}"])
def test_nobody_takes_the_name_of_who_goes_and_keeps_them_from_going(database: Database, name: str) -> None:
    people = People(database)
    with database.transaction() as session:
        ada, bob = add_person(session, "Ada"), add_person(session, "Bob")
    with pytest.raises(Conflict, match="is taken"):
        people.rename(bob, name.format(ada))
    with pytest.raises(Conflict, match="is taken"), database.transaction() as session:
        add_person(session, name.format(ada))
    people.rename(bob, "Gone with the wind")
    people.remove(ada)
    with pytest.raises(NotFound):
        people.get(ada)
