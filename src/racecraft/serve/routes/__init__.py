"""The HTTP interface below /api, a file per subject."""
