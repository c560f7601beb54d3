"""Which of somebody's groups they came in by: the first, of those that there were."""

import sqlalchemy as sa
from alembic import op

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """To this version."""
    with op.batch_alter_table("members", schema=None) as batch_op:
        batch_op.add_column(sa.Column("is_home", sa.Boolean(), nullable=False, server_default=sa.false()))
    members = sa.table("members", *(sa.column(name) for name in ("group_id", "user_id", "role", "created")))
    members.append_column(sa.Column("is_home", sa.Boolean()))
    earlier = members.alias("earlier")
    is_earlier = sa.or_(
        earlier.c.created < members.c.created,
        sa.and_(earlier.c.created == members.c.created, earlier.c.group_id < members.c.group_id),
    )
    before = sa.exists().where(earlier.c.user_id == members.c.user_id, earlier.c.role == "racer", is_earlier)
    op.execute(sa.update(members).where(members.c.role == "racer", ~before).values(is_home=True))
    with op.batch_alter_table("members", schema=None) as batch_op:
        batch_op.alter_column("is_home", server_default=None)


def downgrade() -> None:
    """Back to the one before."""
    with op.batch_alter_table("members", schema=None) as batch_op:
        batch_op.drop_column("is_home")
