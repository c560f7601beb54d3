"""What organisers say about the models of those who came in by their group."""
