"""Pictures that lessons make of what they found: one style for all, drawn with Pillow alone."""

from racecraft.course.pictures.charts import bar_chart, line_chart, scatter
from racecraft.course.pictures.grids import heat_maps, image_rows, value_grids
from racecraft.course.pictures.roads import drawn_lines, film

__all__ = ["bar_chart", "drawn_lines", "film", "heat_maps", "image_rows", "line_chart", "scatter", "value_grids"]
