"""Where things are kept: database, object store."""
