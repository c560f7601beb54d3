"""Which lessons of the course somebody has read, and how well they answered."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    op.create_table(
        "studied_lessons",
        sa.Column("user_id", sa.Integer(), nullable=False),
        sa.Column("lesson", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("read", sa.DateTime(timezone=True), nullable=True),
        sa.Column("quiz", sa.Float(), nullable=True),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("user_id", "lesson"),
    )


def downgrade() -> None:
    """Back to the one before."""
    op.drop_table("studied_lessons")
