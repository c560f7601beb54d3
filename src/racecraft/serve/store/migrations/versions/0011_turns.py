"""Places that go round: since when a job has its own, who waits for it, and how long it has had any."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        for name in ("held_since", "rested", "asked"):
            batch_op.add_column(sa.Column(name, sa.DateTime(timezone=True), nullable=True))
        batch_op.add_column(sa.Column("used", sa.Float(), nullable=False, server_default="0"))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        for name in ("held_since", "rested", "asked", "used"):
            batch_op.drop_column(name)
