"""Races between models."""
