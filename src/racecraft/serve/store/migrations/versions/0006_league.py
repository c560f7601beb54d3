"""People: accounts, cards, tokens, groups, invitations, submissions; and whose models and jobs are."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("users", schema=None) as batch_op:
        batch_op.add_column(sa.Column("handle", sa.String(length=200), nullable=True))
        batch_op.add_column(sa.Column("role", sa.String(length=16), nullable=False, server_default="racer"))
        batch_op.add_column(sa.Column("password", sa.String(length=200), nullable=False, server_default=""))
        batch_op.add_column(sa.Column("deleted", MOMENT, nullable=True))
        batch_op.create_unique_constraint("users_handle_key", ["handle"])
    op.execute("UPDATE users SET role = 'admin', handle = lower(name) WHERE id = 1")
    with op.batch_alter_table("sessions", schema=None) as batch_op:
        batch_op.add_column(sa.Column("expires", MOMENT, nullable=True))
        batch_op.create_index(batch_op.f("ix_sessions_user_id"), ["user_id"], unique=False)
    op.create_table(
        "groups",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("title", sa.String(length=100), nullable=False),
        sa.Column("created", MOMENT, nullable=False),
        sa.PrimaryKeyConstraint("id"),
    )
    _secrets()
    _groups()
    _owners()
    op.create_table(
        "submissions",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("race_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("job_id", sa.String(length=32), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("model", sa.String(length=64), nullable=False),
        sa.Column("score_ms", sa.Integer(), nullable=True),
        sa.Column("best_lap_ms", sa.Integer(), nullable=True),
        sa.Column("resets", sa.Integer(), nullable=False),
        sa.Column("completion", sa.Float(), nullable=False),
        sa.Column("judged", MOMENT, nullable=True),
        sa.Column("disqualified", sa.String(length=200), nullable=False),
        sa.Column("created", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["race_id"], ["races.id"]),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.ForeignKeyConstraint(["job_id"], ["jobs.id"]),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("race_id", "digest"),
    )
    with op.batch_alter_table("submissions", schema=None) as batch_op:
        for name in ("race_id", "user_id", "job_id"):
            batch_op.create_index(batch_op.f(f"ix_submissions_{name}"), [name], unique=False)
        batch_op.create_index("submissions_by_score", ["race_id", "score_ms", "best_lap_ms", "resets"], unique=False)


def _secrets() -> None:
    op.create_table(
        "cards",
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("created", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("digest"),
    )
    op.create_table(
        "tokens",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("title", sa.String(length=64), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("created", MOMENT, nullable=False),
        sa.Column("expires", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("digest"),
    )
    for table in ("cards", "tokens"):
        with op.batch_alter_table(table, schema=None) as batch_op:
            batch_op.create_index(batch_op.f(f"ix_{table}_user_id"), ["user_id"], unique=False)


def _groups() -> None:
    op.create_table(
        "members",
        sa.Column("group_id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("role", sa.String(length=16), nullable=False),
        sa.Column("real_name", sa.String(length=100), nullable=False),
        sa.Column("created", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["group_id"], ["groups.id"]),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("group_id", "user_id"),
    )
    op.create_table(
        "invitations",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("code", sa.String(length=32), nullable=False),
        sa.Column("group_id", sa.Integer(), nullable=True),
        sa.Column("role", sa.String(length=16), nullable=False),
        sa.Column("uses_left", sa.Integer(), nullable=False),
        sa.Column("created", MOMENT, nullable=False),
        sa.Column("expires", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["group_id"], ["groups.id"]),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("code"),
    )
    with op.batch_alter_table("members", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_members_user_id"), ["user_id"], unique=False)
    with op.batch_alter_table("invitations", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_invitations_group_id"), ["group_id"], unique=False)


def _owners() -> None:
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("user_id", sa.Integer(), nullable=False, server_default="1"))
        batch_op.create_foreign_key("jobs_user_id_fkey", "users", ["user_id"], ["id"])
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("group_id", sa.Integer(), nullable=True))
        batch_op.create_foreign_key("races_group_id_fkey", "groups", ["group_id"], ["id"])
        batch_op.create_index(batch_op.f("ix_races_group_id"), ["group_id"], unique=False)
    op.create_table(
        "models_of_owners",
        sa.Column("owner_id", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("tags", sa.JSON(), nullable=False),
        sa.Column("fingerprint", sa.String(length=200), nullable=False),
        sa.Column("summary", sa.JSON(), nullable=False),
        sa.Column("deleted", MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["owner_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("owner_id", "name"),
    )
    columns = "owner_id, name, tags, fingerprint, summary, deleted"
    op.execute(f"INSERT INTO models_of_owners ({columns}) SELECT {columns} FROM models")
    op.drop_table("models")
    op.rename_table("models_of_owners", "models")


def downgrade() -> None:
    """Back to the one before; what others than the owner have is forgotten."""
    op.drop_table("submissions")
    op.execute("DELETE FROM models WHERE owner_id <> 1")
    op.execute("DELETE FROM entries WHERE user_id <> 1")
    op.execute("DELETE FROM driven_records WHERE user_id <> 1")
    op.execute("DELETE FROM races WHERE group_id IS NOT NULL OR owner_id <> 1")
    op.execute("DELETE FROM jobs WHERE user_id <> 1")
    op.execute("DELETE FROM sessions WHERE user_id <> 1")
    op.create_table(
        "models_by_name",
        sa.Column("name", sa.String(length=64), nullable=False),
        sa.Column("owner_id", sa.Integer(), nullable=False),
        sa.Column("tags", sa.JSON(), nullable=False),
        sa.Column("fingerprint", sa.String(length=200), nullable=False),
        sa.Column("summary", sa.JSON(), nullable=False),
        sa.Column("deleted", MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["owner_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("name"),
    )
    columns = "name, owner_id, tags, fingerprint, summary, deleted"
    op.execute(f"INSERT INTO models_by_name ({columns}) SELECT {columns} FROM models")
    op.drop_table("models")
    op.rename_table("models_by_name", "models")
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_races_group_id"))
        batch_op.drop_constraint("races_group_id_fkey", type_="foreignkey")
        batch_op.drop_column("group_id")
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_constraint("jobs_user_id_fkey", type_="foreignkey")
        batch_op.drop_column("user_id")
    for table in ("invitations", "members", "tokens", "cards", "groups"):
        op.drop_table(table)
    with op.batch_alter_table("sessions", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_sessions_user_id"))
        batch_op.drop_column("expires")
    op.execute("DELETE FROM users WHERE id <> 1")
    with op.batch_alter_table("users", schema=None) as batch_op:
        batch_op.drop_constraint("users_handle_key", type_="unique")
        for name in ("deleted", "password", "role", "handle"):
            batch_op.drop_column(name)
