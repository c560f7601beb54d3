"""Learn by racing: lessons that are Python files, exercises that check themselves, quizzes, and pictures.

    from racecraft.course import check, show
    from racecraft.course.pictures import line_chart

    show(line_chart("What was earned", {"ε = 0.1": rewards}), "earned")

`racecraft lessons` lists them; `lessons/` holds them.
"""

from racecraft.course.exercises import check, checks_of
from racecraft.course.lesson import Lesson, find_lesson, lessons, lessons_folder
from racecraft.course.notebook import to_notebook, write_notebook
from racecraft.course.percent import Cell, read_cells
from racecraft.course.progress import read_progress, record_quiz
from racecraft.course.show import Picture, show
from racecraft.course.verdict import Verdict

__all__ = [
    "Cell",
    "Lesson",
    "Picture",
    "Verdict",
    "check",
    "checks_of",
    "find_lesson",
    "lessons",
    "lessons_folder",
    "read_cells",
    "read_progress",
    "record_quiz",
    "show",
    "to_notebook",
    "write_notebook",
]
