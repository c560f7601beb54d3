"""Reward functions: presets, checks, and what they pay along a track."""
