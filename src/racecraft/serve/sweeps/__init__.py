"""Sweeps: settings by seeds, trained on whichever machines there are."""
