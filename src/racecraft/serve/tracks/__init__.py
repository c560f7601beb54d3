"""The gallery of tracks and the user's own."""
