"""Jobs may be done by other machines; the one that has a job is named."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("travels", sa.Boolean(), nullable=False, server_default=sa.false()))
        batch_op.add_column(sa.Column("machine", sa.String(64), nullable=False, server_default=""))
        batch_op.add_column(sa.Column("watched_until", sa.DateTime(timezone=True), nullable=True))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("jobs", schema=None) as batch_op:
        batch_op.drop_column("watched_until")
        batch_op.drop_column("machine")
        batch_op.drop_column("travels")
