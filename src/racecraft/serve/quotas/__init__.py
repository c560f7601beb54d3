"""What a racer, and all of a group together, may use of the machine."""
