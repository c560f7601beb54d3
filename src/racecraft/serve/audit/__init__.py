"""Who did what with power."""
