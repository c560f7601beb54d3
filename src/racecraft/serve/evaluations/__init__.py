"""Races against the clock, and what their laps say."""
