"""Alembic's entry: the connection comes from `Database.migrate`."""

from alembic import context

from racecraft.serve.store.tables import Table

connection = context.config.attributes["connection"]
context.configure(connection=connection, target_metadata=Table.metadata, render_as_batch=True, compare_type=True)
with context.begin_transaction():
    context.run_migrations()
