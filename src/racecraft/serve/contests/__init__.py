"""Models against models: heats on one road, and ladders."""
