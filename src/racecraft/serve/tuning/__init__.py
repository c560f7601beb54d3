"""Searches for better numbers."""
