"""Races that follow one another, how often one enters, what is frozen; and whose turn it is."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("attempts_per_day", sa.Integer(), nullable=False, server_default="0"))
        batch_op.add_column(sa.Column("is_frozen", sa.Boolean(), nullable=False, server_default=sa.false()))
        batch_op.add_column(sa.Column("after_id", sa.Integer(), nullable=True))
        batch_op.add_column(sa.Column("best_of_it", sa.Integer(), nullable=False, server_default="0"))
        batch_op.create_foreign_key("races_after_id_fkey", "races", ["after_id"], ["id"])
    op.create_index("jobs_by_user", "jobs", ["user_id", "state", "created"], unique=False)


def downgrade() -> None:
    """Back to the one before."""
    op.drop_index("jobs_by_user", table_name="jobs")
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.drop_constraint("races_after_id_fkey", type_="foreignkey")
        for name in ("best_of_it", "after_id", "is_frozen", "attempts_per_day"):
            batch_op.drop_column(name)
