"""Finals in which two meet at a time."""

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    op.create_table(
        "finalists",
        sa.Column("race_id", sa.Integer(), sa.ForeignKey("races.id"), nullable=False),
        sa.Column("seed", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("submission_id", sa.Integer(), sa.ForeignKey("submissions.id"), nullable=False),
        sa.Column("place", sa.Integer(), nullable=True),
        sa.PrimaryKeyConstraint("race_id", "seed"),
    )
    op.create_table(
        "duels",
        sa.Column("race_id", sa.Integer(), sa.ForeignKey("races.id"), nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("first", sa.Integer(), nullable=False),
        sa.Column("second", sa.Integer(), nullable=False),
        sa.Column("winner", sa.Integer(), nullable=False),
        sa.Column("results", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("race_id", "number"),
    )
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.add_column(sa.Column("final_job_id", sa.String(32), nullable=True))
        batch_op.create_foreign_key("races_final_job", "jobs", ["final_job_id"], ["id"])


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("races", schema=None) as batch_op:
        batch_op.drop_constraint("races_final_job", type_="foreignkey")
        batch_op.drop_column("final_job_id")
    op.drop_table("duels")
    op.drop_table("finalists")
