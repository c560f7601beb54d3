"""Links for a new password; and a log of who did not come in, of whom nobody may know who it was."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    op.create_table(
        "resets",
        sa.Column("digest", sa.String(length=64), nullable=False),
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("created", sa.DateTime(timezone=True), nullable=False),
        sa.Column("expires", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("digest"),
    )
    op.create_index("ix_resets_user_id", "resets", ["user_id"], unique=False)
    with op.batch_alter_table("deeds") as deeds:
        deeds.alter_column("user_id", existing_type=sa.Integer(), nullable=True)


def downgrade() -> None:
    """Back to the one before."""
    op.execute("DELETE FROM deeds WHERE user_id IS NULL")
    with op.batch_alter_table("deeds") as deeds:
        deeds.alter_column("user_id", existing_type=sa.Integer(), nullable=False)
    op.drop_table("resets")
