"""A league's races: what is submitted, how it is judged, the board."""
