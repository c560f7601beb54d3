"""What drivers choose on hidden frames, by which near-copies are known."""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    op.create_table(
        "choices",
        sa.Column("submission_id", sa.Integer(), nullable=False),
        sa.Column("commands", sa.String(2000), nullable=False),
        sa.Column("like_id", sa.Integer(), nullable=True),
        sa.Column("likeness", sa.Float(), nullable=False),
        sa.Column("is_accepted", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["like_id"], ["submissions.id"]),
        sa.ForeignKeyConstraint(["submission_id"], ["submissions.id"]),
        sa.PrimaryKeyConstraint("submission_id"),
    )


def downgrade() -> None:
    """Back to the one before."""
    op.drop_table("choices")
