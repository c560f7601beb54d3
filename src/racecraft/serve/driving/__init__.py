"""Driving oneself, against ghosts."""
