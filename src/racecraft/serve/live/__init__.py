"""The cars of a training as they drive."""
