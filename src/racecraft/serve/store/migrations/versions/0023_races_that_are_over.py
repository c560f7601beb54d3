"""Races of which people know that they are over, which stay so though a clock be set back."""

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("over", sa.DateTime(timezone=True), nullable=True))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.drop_column("over")
