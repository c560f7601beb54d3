"""Who has a password and was locked out."""

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("users", schema=None) as batch_op:
        batch_op.add_column(sa.Column("is_locked", sa.Boolean(), nullable=False, server_default=sa.false()))
    with op.batch_alter_table("users", schema=None) as batch_op:
        batch_op.alter_column("is_locked", server_default=None)


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("users", schema=None) as batch_op:
        batch_op.drop_column("is_locked")
