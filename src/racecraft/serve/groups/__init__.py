"""Classes, clubs, events: who is in them, and the codes that let people in."""
