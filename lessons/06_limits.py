# %% [markdown]
# # Lesson 6 · Where tables break
#
# **Goal.** You can say why a table of finer cells learns worse, compute how many cells a world would need, and name
# what must come instead.
#
# Tables drove a car. So why does anybody need neural networks? This lesson takes a table to where it breaks, twice:
# once with two numbers, and once with a camera.

# %% [markdown]
# ## A car in a valley
#
# The classic test is `MountainCar-v0`. A weak car stands in a valley, the flag is on the right hill. Its engine is
# too weak to drive up; it must swing, back and forth, until it has the speed. The state is two numbers: position and
# velocity. The actions: push left, nothing, push right.
#
# *Something that is often said wrongly:* that it pays 10, or 100, at the flag. Let us look.

# %%
import gymnasium
import numpy as np

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.pictures import bar_chart, heat_maps, line_chart

valley = gymnasium.make("MountainCar-v0")
(position, velocity), _ = valley.reset(seed=1)
path, rewards, is_over = [(position, velocity)], [], False
while not is_over:
    push = 2 if velocity >= 0 else 0  # always push the way it rolls: a rule that works, found by thinking
    (position, velocity), reward, terminated, truncated, _ = valley.step(push)
    path.append((position, velocity))
    rewards.append(float(reward))
    is_over = terminated or truncated
path = np.array(path)
print(
    f"{len(rewards)} steps. All rewards that came: {sorted(set(rewards))}. The last one, at the flag: {rewards[-1]:g}."
)

# %% [markdown]
# Every step pays **-1, the one to the flag included**, and after 200 steps the walk is cut off. So the best is what
# ends soonest, and a learner that has never seen the flag sees -1 everywhere: nothing tells it that it is getting
# warmer. (The 100 at the flag belong to another world, `MountainCarContinuous-v0`.)

# %%
show(
    line_chart(
        "Swinging up",
        {"position": path[:, 0]},
        subtitle="The rule 'push the way you roll': each swing gets higher, until the flag",
        x_label="steps",
        y_label="position",
        marks={"flag": 0.5, "bottom of the valley": -np.pi / 6},
    ),
    "swinging-up",
)

# %% [markdown]
# ## Coarse, fine, finer
#
# Two numbers, so we cut both into as many intervals. How many? Let three tables learn for as long, 120,000 steps.

# %%
tables = {}
for bins in (3, 12, 48):
    tables[bins] = learn(
        "MountainCar-v0",
        "q-table",
        seed=2,
        until="120000 steps",
        settings={
            "bins": bins,
            "num_envs": 8,
            "gamma": 1.0,
            "learning_rate": 0.3,
            "final_learning_rate": 0.02,
            "epsilon": 0.1,
            "final_epsilon": 0.0,
            "exploration": 0.9,
        },
    )
    visited = (tables[bins].policy.values != 0.0).any(axis=1).sum()
    print(f"{bins:3} x {bins:<3} {bins**2:6,} cells, {visited:6,} visited: return {tables[bins].mean_return:7.1f}")

# %% [markdown]
# What each table thinks a place is worth: to the right the position, upwards the velocity. Dark is far from the flag.
# The white line is the swing from above.

# %%
worths = {}
for bins, one in tables.items():
    values = one.policy.values.reshape(bins, bins, 3)
    worth = np.where((values == 0.0).all(axis=-1), np.nan, values.max(axis=-1)).T  # rows: velocity
    worths[f"{bins} x {bins}: {one.mean_return:.0f}"] = worth
show(
    heat_maps(
        "The same valley in three tables",
        worths,
        x_range=(-1.2, 0.6),
        y_range=(-0.07, 0.07),
        subtitle="Worth of every cell after 120,000 steps, and what the table reaches; grey: never been there",
        x_label="position",
        y_label="velocity",
        paths=dict.fromkeys(worths, path),
    ),
    "three-tables",
)

# %% [markdown]
# - **3 × 3** is too coarse: rolling left and standing are one cell, yet they need different pushes. No amount of
#   learning helps: two states that need different actions share a row.
# - **12 × 12** finds the flag.
# - **48 × 48** could represent everything, and knows nothing: each of its 2,304 cells must be visited many times, and
#   what is learned in one says nothing about its neighbour. Coarse tables are wrong for ever, fine ones are ignorant
#   for ever.
#
# The picture is smooth: neighbours are worth nearly the same. A table cannot use that. Something that *could* would
# learn from one visit about all the surroundings: a **function** with few parameters, fitted to what was seen. Such a
# function is what a neural network is.

# %% [markdown]
# ## And with a camera?
#
# Cells multiply with every number. Let us count, with ten intervals each:

# %%
worlds = {
    "frozen lake (16 squares)": np.log10(16),
    "our car in a table": np.log10(147),
    "MountainCar, 2 numbers": 2.0,
    "CartPole, 4 numbers": 4.0,
    "Acrobot, 6 numbers": 6.0,
    "our car, 16 numbers": 16.0,
    "atoms of the universe": 80.0,
}
show(
    bar_chart(
        "How many zeros the number of cells has",
        worlds,
        subtitle="Ten intervals for every number. A camera of 160 x 120 pixels has 19,200 zeros: no bar is so long",
        highlighted=["our car, 16 numbers"],
        digits=1,
    ),
    "cells",
)
print(f"A camera with ten shades to each pixel: a 1 with {160 * 120:,} zeros.")

# %% [markdown]
# A billion steps a second since the big bang would be some 4 × 10²⁶ visits: for a table of our car's 16 numbers that
# is enough to look into every cell, for a camera it is nothing. This growth has a name, the **curse of
# dimensionality**. No car ever sees the same picture twice, and it must know what to do all the same.

# %% [markdown]
# ## Your turn
#
# Write what every table needs first: the number of the cell. `numbers` are the values seen, `low` and `high` their
# bounds, and each is cut into `bins` even intervals. Return a whole number from 0 to `bins ** len(numbers) - 1`, a
# different one for every combination of intervals.


# %% exercise cell
def cell(numbers, low, high, bins):
    total = 0
    for value, bottom, top in zip(numbers, low, high, strict=True):
        total += int((value - bottom) / (top - bottom) * bins)
    return total


# %%
verdict = check("6.cell", cell)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - Too **coarse**: different states share a row. Too **fine**: rows are never visited often enough. Between them
#   there is little room, and with every further number there is less.
# - A table learns **nothing about neighbours**. What comes next, a network, is nothing but a function that does.
# - `MountainCar-v0` pays -1 for every step and nothing for the flag.
#
# In lesson 7 a small network takes the table's place, and the update stays what it was. Answer the quiz: `racecraft
# lessons quiz 6`.
