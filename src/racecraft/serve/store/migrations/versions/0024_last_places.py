"""The places that a final had, which count until it has been driven once more."""

import sqlalchemy as sa
from alembic import op

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("last_places", sa.JSON(), nullable=True))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.drop_column("last_places")
