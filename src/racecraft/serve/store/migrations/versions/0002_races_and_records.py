"""What a race is about, entries that are withdrawn, and laps driven by hand."""

import sqlalchemy as sa
from alembic import op

revision = "0002_races"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("description", sa.String(length=500), nullable=False, server_default=""))
        batch_op.add_column(sa.Column("visibility", sa.String(length=16), nullable=False, server_default="private"))
        batch_op.add_column(sa.Column("kind", sa.String(length=24), nullable=False, server_default="time-trial"))
        batch_op.add_column(sa.Column("objects", sa.JSON(), nullable=False, server_default="{}"))
        batch_op.add_column(sa.Column("vehicle", sa.String(length=16), nullable=False, server_default=""))
        batch_op.add_column(sa.Column("seed", sa.BigInteger(), nullable=False, server_default="0"))
        batch_op.add_column(sa.Column("minimum_laps", sa.Integer(), nullable=False, server_default="1"))
        batch_op.add_column(sa.Column("deleted", sa.DateTime(timezone=True), nullable=True))
    with op.batch_alter_table("entries", schema=None) as batch_op:
        batch_op.add_column(sa.Column("withdrawn", sa.DateTime(timezone=True), nullable=True))
    op.create_table(
        "driven_records",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("vehicle", sa.String(length=16), nullable=False),
        sa.Column("direction", sa.String(length=16), nullable=False),
        sa.Column("track", sa.String(length=200), nullable=False),
        sa.Column("seconds", sa.Float(), nullable=False),
        sa.Column("trace", sa.JSON(), nullable=False),
        sa.Column("driven", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("user_id", "digest", "vehicle", "direction"),
    )


def downgrade() -> None:
    """Back to the one before."""
    op.drop_table("driven_records")
    with op.batch_alter_table("entries", schema=None) as batch_op:
        batch_op.drop_column("withdrawn")
    with op.batch_alter_table("races", schema=None) as batch_op:
        for column in ("deleted", "minimum_laps", "seed", "vehicle", "objects", "kind", "visibility", "description"):
            batch_op.drop_column(column)
