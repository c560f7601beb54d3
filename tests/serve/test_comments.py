"""What an organiser says about a racer's model: who reads it, who takes it back, and that it stays with the model."""

from __future__ import annotations

from pathlib import Path

import pytest
from leagues import ok, refused
from schools import School

from racecraft.serve.comments.comments import MAX_COMMENTS, Comments
from racecraft.serve.problems import Conflict
from racecraft.serve.store.database import Database
from racecraft.serve.store.tables import User

pytestmark = pytest.mark.costly


def test_a_comment_is_read_by_whose_model_it_is_and_goes_where_the_model_goes(school: School) -> None:
    ada, teacher, group = school.people["ada"], school.people["teacher"], school.objects["group_id"]
    about = f"/api/groups/{group}/comments"
    member = school.objects["member"]
    (first,) = ok(ada.get("/api/comments"))
    assert (first["model"], first["author"], first["text"]) == ("adas-model", "Teacher", "Look at the hairpin.")
    assert not first["is_mine"]
    assert ok(school.people["bob"].get("/api/comments")) == []
    said = {"member": member, "model": "adas-model"}
    found = ok(teacher.post(about, json={**said, "text": " Faster!\nBut safer. "}), 201)
    assert [(one["text"], one["is_mine"]) for one in found] == [
        *(("Faster!\nBut safer.", True), ("Look at the hairpin.", True))
    ]
    for text in ("", "   ", "x" * 1001):
        refused(teacher.post(about, json={**said, "text": text}), 422)
    refused(teacher.post(about, json={**said, "model": "nothing", "text": "x"}), 404)

    ok(ada.post("/api/models/adas-model/clone", json={"name": "sketch"}), 201)
    ok(teacher.post(about, json={"member": member, "model": "sketch", "text": "A good start."}), 201)
    ok(ada.patch("/api/models/sketch", json={"name": "racer"}))
    assert [one["model"] for one in ok(ada.get("/api/comments"))] == ["racer", "adas-model", "adas-model"]
    kept = ok(ada.get("/api/account/data"))["comments"]
    assert [one["text"] for one in kept] == ["Look at the hairpin.", "Faster!\nBut safer.", "A good start."]
    ok(ada.delete("/api/models/racer"), 204)
    assert [one["model"] for one in ok(teacher.get(f"{about}?member={member}"))] == ["adas-model", "adas-model"]

    refused(school.people["bob"].delete(f"/api/comments/{first['id']}"), 404)
    refused(school.people["other"].get(f"{about}?member={member}"), 404)
    ok(ada.delete(f"/api/comments/{first['id']}"), 204)
    ok(teacher.delete(f"/api/comments/{found[0]['id']}"), 204)
    assert ok(teacher.get(f"{about}?member={member}")) == []


def test_comments_are_as_many_as_somebody_reads(tmp_path: Path) -> None:
    database = Database(f"sqlite:///{tmp_path / 'console.db'}")
    database.migrate()
    with database.transaction() as session:
        session.add_all(User(id=number, name=f"u{number}", handle=f"u{number}") for number in (11, 12, 13))
    comments = Comments(database)
    for _ in range(MAX_COMMENTS):
        comments.add(11, "fast", "x", author_id=13)
    with pytest.raises(Conflict, match="200 comments on their models"):
        comments.add(11, "slow", "x", author_id=13)
    comments.add(12, "fast", "x", author_id=13)
    database.close()
