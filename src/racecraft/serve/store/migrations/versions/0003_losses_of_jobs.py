"""How often a job's process died is counted apart from how often it was started."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002_races"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("losses", sa.Integer(), nullable=False, server_default="0"))
        batch_op.create_index("jobs_by_kind", ["kind", "run", "created"], unique=False)


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_index("jobs_by_kind")
        batch_op.drop_column("losses")
