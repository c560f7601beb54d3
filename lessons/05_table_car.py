# %% [markdown]
# # Lesson 5 · A table drives a car
#
# **Goal.** You can turn numbers into the cells of a table, let a table drive a car, and say what the discount γ has
# to do with looking ahead.
#
# A lake has sixteen squares. A car has a position, an angle, a speed, a road before it: numbers with decimals, of
# which no two are ever the same. How does that fit into a table? One **cuts** each number into intervals, and gives
# every combination of intervals a row. That is called *discretisation*, and it is done in a minute.

# %% [markdown]
# ## What a driver must know
#
# The simulator tells 16 numbers about the car. To stay on the road three of them are enough:
#
# - where it is **across** the road: -1 is the right border, 0 the middle, 1 the left border,
# - at what **angle** to the road it stands: the sine of the angle, positive to the left,
# - how the road **bends** half a metre ahead: 1 / radius, positive to the left.
#
# Seven intervals for the first, seven for the second, three for the third: 7 × 7 × 3 = 147 cells. In each the car
# chooses one of five steering angles, at 1 metre a second. A table of 147 × 5 = 735 numbers: that is the whole
# driver.

# %%
import numpy as np

from racecraft.classic import learn
from racecraft.classic.recipes import CAR_IN_A_TABLE
from racecraft.course import check, show
from racecraft.course.driving import drive
from racecraft.course.pictures import bar_chart, drawn_lines, film, value_grids

for cut, name in zip(CAR_IN_A_TABLE, ("across the road", "angle to the road", "bend ahead"), strict=True):
    print(f"{name:18} cut at {cut.edges}")

# %% [markdown]
# ## Learning, within seconds
#
# It is the Q-learning of lesson 4, with the very same line. It learns on an oval, with 64 cars at once, which all
# write into the same table; cars that did the same in the same cell move it by their mean. The reward is 1 in the
# middle of the road and falls to 0 at its border. And the table is an optimist: at first it says 6 everywhere, more
# than most cells turn out to be worth, so that each action is tried before it is judged.

# %%
learned = learn("racecraft:Racecraft-v0", "q-table", seed=1)
drives = drive(learned, cars=20, seconds=60.0, seed=1000)
print(f"{learned.steps:,} steps, learned in {learned.learning_seconds:.2f} s: {drives.laps} of 20 laps.")

# %% [markdown]
# What does it look like on the way there?

# %%
stages = {
    f"after {steps:,} steps": drive(
        learn("racecraft:Racecraft-v0", "q-table", seed=1, until=f"{steps} steps"), cars=20, seconds=60.0, seed=1000
    )
    for steps in (5_000, 20_000)
}
stages["after 40,000 steps"] = drives
show(
    drawn_lines(
        "A table learns to drive",
        stages,
        subtitle="Lines of 4 of 20 cars, each from its own place; a red dot: off the road",
        cars=4,
    ),
    "learning-to-drive",
)
show(film("735 numbers drive a car", {"the table": drives}, seconds=8.0, subtitle="20 cars, the same table"), "film")

# %% [markdown]
# ## Look into its head
#
# A great thing about tables: one can read them. Here is what the table has learned, a square for each cell. The arrow
# is where it steers (straight up: straight on), the colour what it expects to earn. The left sheet is for a straight
# road ahead, the right one for a bend to the left.

# %%
values = learned.policy.values.reshape(7, 7, 3, 5)  # across, angle, bend, action
ANGLES = np.radians([-30, -15, 0, 15, 30])  # of the five actions, left positive
AT_FIRST = 6.0  # what the table says of a cell in which nobody has been


def sheet(bend):
    """Rows: angle to the road, left on top. Columns: place across the road, left border first, as one sees it."""
    cells = values[::-1, :, bend].transpose(1, 0, 2)[::-1]
    known = (cells != AT_FIRST).any(axis=-1)
    turn = 2.0 * ANGLES[cells.argmax(axis=-1)]
    arrows = np.stack([-np.sin(turn), np.cos(turn)], axis=-1) * known[..., None]
    return np.where(known, cells.max(axis=-1), np.nan), arrows


show(
    value_grids(
        "What the table does",
        {"straight ahead": sheet(1), "a bend to the left ahead": sheet(2)},
        subtitle="Arrow: where it steers, drawn twice as wide; bright: expects much; grey: never been there",
        digits=-1,
        y_label="top: car points left, bottom: right",
        x_label="left border to right border",
    ),
    "inside-the-table",
)

# %% [markdown]
# Read a few squares. At the left border it steers right, at the right border left; where the car already points to
# the right it steers left, and the other way round. Nobody has written that down. And a **third** sheet, for bends to
# the right, is empty:

# %%
print(
    "Cells never visited, by bend ahead (right, straight, left):",
    (values == AT_FIRST).all(axis=-1).sum(axis=(0, 1)),
    "of 49",
)
elsewhere = drive(learned, "reinvent_2018", cars=20, seconds=60.0, seed=1000)
print(f"On another track, with bends to the right: {elsewhere.laps} of 20 laps.")

# %% [markdown]
# This oval has no bend to the right, so the table knows nothing of such bends, and on another track it leaves the
# road at one of them. **A table knows only what it has seen, cell by cell.** Nothing that it learned about a bend to
# the left helps in one to the right.

# %% [markdown]
# ## γ: how far ahead it looks
#
# A driver with γ = 0 wants the reward of the next step and nothing else. With γ = 0.9 a reward ten steps ahead
# still counts a third. What does that do?

# %%
laps = {}
for gamma in (0.0, 0.3, 0.5, 0.7, 0.9):
    short = learn("racecraft:Racecraft-v0", "q-table", seed=1, settings={"gamma": gamma})
    laps[f"γ = {gamma}"] = drive(short, cars=20, seconds=60.0, seed=1000).laps
show(
    bar_chart("Who looks ahead stays on the road", laps, subtitle="Laps of 20, by the discount", digits=0),
    "looking-ahead",
)

# %% [markdown]
# In one step, a fifteenth of a second, steering changes nearly nothing: the car is where it was, and only begins to
# turn. Without looking ahead all five angles earn the same, and the table cannot tell them apart. The worth of the
# *next* cell is what makes the difference: Bellman again.

# %% plaything track [markdown]
# *To play with:* this lesson's page in the console (`racecraft serve`, *Course*) has a road of 240 places, painted with
# what each is worth, while a car finds it out. Let it run, and see the worth of the line creep backwards, against the
# way that the car drives. Then make γ small: how far does it get?

# %% [markdown]
# ## Your turn: the smallest driver
#
# 147 cells work. How few do? Choose your own cuts: at most 60 cells, and at least 19 of 20 laps with two seeds. `k`
# edges make `k + 1` intervals; `()` leaves a number out.

# %% exercise cuts
cuts = {
    "offset": (),
    "sin_heading_error": (-0.2, -0.07, 0.07, 0.2),
    "curvature_2": (-0.3, 0.3),
}

# %%
verdict = check("5.cuts", cuts)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - **Cutting** numbers into intervals makes a table of any world. Which numbers, and where to cut, is knowledge that
#   *we* put in.
# - A table can be **read**. That is rare among learners, and worth something.
# - It knows **only what it has seen**: no two cells share anything. The next lesson shows how quickly that ends.
#
# Answer the quiz: `racecraft lessons quiz 5`.
