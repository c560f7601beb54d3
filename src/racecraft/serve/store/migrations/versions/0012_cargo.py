"""What the object store has for a job that another machine may do."""

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("cargo", sa.JSON(), nullable=False, server_default="{}"))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_column("cargo")
