"""Races are announced, have a secret and several trials; those of before have none of it."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("trials", sa.Integer(), nullable=False, server_default="1"))
        batch_op.add_column(sa.Column("document", sa.JSON(), nullable=False, server_default="{}"))
        batch_op.add_column(sa.Column("commitment", sa.String(length=64), nullable=False, server_default=""))
        batch_op.add_column(sa.Column("secret", sa.String(length=64), nullable=False, server_default=""))


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        for name in ("secret", "commitment", "document", "trials"):
            batch_op.drop_column(name)
