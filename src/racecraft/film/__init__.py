"""What was driven, as pictures: films with ghosts, and the racing line coloured by speed."""

from racecraft.film.racing_line import draw_racing_line
from racecraft.film.video import film

__all__ = ["draw_racing_line", "film"]
