# %% [markdown]
# # Lesson 4 · A table of values
#
# **Goal.** You can read and write Bellman's equation, fill a Q-table with Q-learning and SARSA, and say why they walk
# differently beside a cliff.
#
# In a slot machine a choice changes only what is paid. Nearly everywhere else it also changes **where one is next**:
# who brakes late must take what the bend then offers. So a learner has to look ahead. The trick that makes this
# possible is seventy years old, and fits in one line.

# %% [markdown]
# ## A frozen lake
#
# Sixteen squares of ice. You start at the top left and want to reach the goal at the bottom right, which pays 1.
# Everything else pays 0, and a hole ends the walk. And it is slippery: of three steps only one goes where you want it
# to, the other two slip to one side.
#
# - The **state** is the square you are on, 0 to 15.
# - The **actions** are left, down, right, up.
# - An **episode** ends in a hole, at the goal, or after 100 steps.

# %%
import gymnasium
import numpy as np

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.pictures import bar_chart, line_chart, value_grids

lake = gymnasium.make("FrozenLake-v1").unwrapped  # 4 x 4 squares, slippery
print("\n".join("".join(letter.decode() for letter in row) for row in lake.desc))
print("From square 14, a step to the right (probability, square, reward, is over):")
for outcome in lake.P[14][2]:
    print("  ", outcome)

# %% [markdown]
# ## Bellman's equation: the worth of a square
#
# How much is a square worth? As much as one can still get from it. The square left of the goal is worth much, since
# the goal is one step away; the one before it nearly as much. Put generally, for somebody who always does the best:
#
# > **The worth of a state is the reward of the best action, plus γ times the worth of where that leads.**
#
# $$V(s) = \max_a \sum_{s'} P(s' \mid s, a)\,\big[\,r + \gamma\,V(s')\,\big]$$
#
# (On ice an action leads to several squares, so all are counted, each as often as it happens.) The discount **γ**
# (gamma), a little under 1, makes a reward that comes later count less than one that comes now; so a learner hurries.
#
# This is a riddle that defines itself: worths on both sides. But one can solve it in the simplest way: begin with
# zeros and put them in on the right, again and again. That is **dynamic programming**.


# %%
def solve(gamma, sweeps=300):
    """The true worth of every action in every square (16, 4), from the known rules of the lake."""
    worth = np.zeros((16, 4))
    for _ in range(sweeps):
        best = worth.max(axis=1)
        worth = np.zeros((16, 4))
        for s in range(16):
            for a in range(4):
                for p, after, reward, over in lake.P[s][a]:
                    worth[s, a] += p * (reward + gamma * (0.0 if over else best[after]))
    return worth


truth = solve(gamma=0.99)

# %% [markdown]
# ## Q-learning: the same without knowing the rules
#
# Dynamic programming needs the rules of the world: how likely each slip is. A learner has none. It only walks, and
# sees what happens: state, action, reward, next state. So it keeps a table with a guess **Q(s, a)** of what each
# action in each state is worth, and after every step moves it a little towards what it has just seen:
#
# $$Q(s,a) \leftarrow Q(s,a) + \alpha\,\big[\,\underbrace{r + \gamma \max_{a'} Q(s',a')}_{\text{what the step turned
# out to be worth}} - Q(s,a)\,\big]$$
#
# You know this line from the slot machines: old guess + a step × surprise. New is only that the worth of the next
# square is part of what came. So knowledge of the goal creeps backwards, a square with each visit.
#
# `src/racecraft/classic/q_table.py` is this line and little else. Read it: it has about a hundred lines.

# %%
learned = learn("FrozenLake-v1", "q-table", seed=1, until="150000 steps")
table = learned.policy.values  # (16, 4)
print(f"{learned.steps:,} steps in {learned.learning_seconds:.1f} s.")
print(f"{100 * learned.mean_return:.0f} of 100 walks reach the goal.")

STEPS = np.array([[-1, 0], [0, -1], [1, 0], [0, 1]])  # left, down, right, up


def grid(worth, shape):
    """Best worth and best action of every square, for a picture; holes and the goal have none."""
    worth = worth.reshape(*shape, 4)
    value = worth.max(axis=-1)
    return np.where(value == 0.0, np.nan, value), STEPS[worth.argmax(axis=-1)] * (value != 0.0)[..., None]


words = {divmod(s, 4): {b"H": "hole", b"G": "goal"}[lake.desc.flat[s]] for s in range(16) if lake.desc.flat[s] in b"HG"}
show(
    value_grids(
        "What every square is worth, and what to do there",
        {"solved from the known rules": grid(truth, (4, 4)), "learned by walking": grid(table, (4, 4))},
        subtitle="Worth of the best action; the arrow is where one tries to go, and slips aside two times out of three",
        words=words,
    ),
    "lake",
)

# %% [markdown]
# Look at the arrows first. Some seem mad: beside a hole one walks *away* from it, or even into the wall. On this ice
# that is clever: who pushes against the wall never slips into the hole. Nobody told the learner.
#
# And compare the numbers. The table was filled by walking alone, and comes close to the exact worths. Where it is off
# it is because good walkers rarely get there: a learner knows best what it visits most.

# %%
visited = ~np.isin(np.arange(16), [5, 7, 11, 12, 15])
error = np.abs(table.max(axis=1) - truth.max(axis=1))[visited]
print(f"Mean difference between table and truth: {error.mean():.3f}; largest: {error.max():.3f}.")

# %% [markdown]
# What is that worth in walks? With the rules known, one can compute exactly how often a way of walking reaches the
# goal:


# %%
def chance_of_the_goal(choices):
    """Chance to reach the goal within 100 steps, for somebody who does action a in square s with choices[s, a]."""
    where = np.eye(16)[0]  # chance to be on each square
    arrived = 0.0
    for _ in range(100):
        there = np.zeros(16)
        for s in range(16):
            for a in range(4):
                for p, after, reward, over in lake.P[s][a]:
                    chance = where[s] * choices[s, a] * p
                    arrived += chance * reward
                    there[after] += 0.0 if over else chance
        where = there
    return arrived


show(
    bar_chart(
        "Who reaches the goal?",
        {
            "by lot": 100 * chance_of_the_goal(np.full((16, 4), 0.25)),
            "the learned table": 100 * chance_of_the_goal(np.eye(4)[table.argmax(axis=1)]),
            "the best there is": 100 * chance_of_the_goal(np.eye(4)[truth.argmax(axis=1)]),
        },
        subtitle="Walks of 100 that get there on slippery ice; nobody gets all of them there",
    ),
    "who-reaches-the-goal",
)

# %% plaything grid [markdown]
# *To play with:* this lesson's page in the console (`racecraft serve`, *Course*) has a grid whose table fills while one
# watches. Go step by step until the first goal is found, and see how its worth creeps backwards; then let it run, and
# try ε = 0, or a small γ.

# %% [markdown]
# ## SARSA beside a cliff
#
# Q-learning's update asks for the **best** next action, whatever is done next. Its sister SARSA (state, action,
# reward, state, action) asks for the action that **really comes next**, mistakes made on purpose included:
#
# $$Q(s,a) \leftarrow Q(s,a) + \alpha\,\big[\,r + \gamma\,Q(s',a') - Q(s,a)\,\big]$$
#
# One symbol less, and another character. Here is a cliff: every step costs 1, a step over the edge costs 100 and puts
# you back to the start. Both explore all the time here: one step in ten is drawn by lot.

# %%
both = {
    name: learn(
        "CliffWalking-v1",
        algorithm,
        seed=1,
        until="40000 steps",
        settings={"epsilon": 0.1, "final_epsilon": 0.1, "final_learning_rate": 0.1},
    )
    for name, algorithm in {"Q-learning": "q-table", "SARSA": "sarsa"}.items()
}
COMPASS = np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])  # up, right, down, left


def cliff_grid(values):
    """Best worth of every square on the way that the table takes, and where it leads."""
    values = values.reshape(4, 12, 4)
    value = np.where((values == 0.0).all(axis=-1), np.nan, values.max(axis=-1))
    arrows = np.zeros((4, 12, 2))
    row, column = 3, 0
    for _ in range(30):
        step = COMPASS[values[row, column].argmax()]
        arrows[row, column] = step
        row, column = row - step[1], column + step[0]
        if (row, column) == (3, 11) or (row == 3 and column > 0):
            break
    return value, arrows


edge = {(3, column): "cliff" for column in range(1, 11)} | {(3, 11): "goal"}
show(
    value_grids(
        "The same cliff, two characters",
        {name: cliff_grid(one.policy.values) for name, one in both.items()},
        subtitle="Worth of every square, and the way that the table takes from the lower left",
        words=edge,
        columns=1,
        digits=0,
    ),
    "cliff",
)

# %% [markdown]
# **Q-learning** learns what a perfect walker would get, and goes along the very edge: 13 steps, the shortest way.
# **SARSA** knows that it stumbles one step in ten, and keeps a distance. Which of the two is better? Look at what
# they really got while they walked and stumbled:

# %%
recent = 100
show(
    line_chart(
        "Living beside the edge",
        {
            name: np.convolve(one.returns, np.full(recent, 1 / recent), mode="valid")[:1200]
            for name, one in both.items()
        },
        subtitle="Reward of a walk while learning, mean of the last 100 walks; one step in ten is by lot",
        x_label="walks",
        y_label="reward",
        y_range=(-80, 0),
        marks={"shortest way": -13.0},
    ),
    "living-beside-the-edge",
)
for name, one in both.items():
    print(f"{name:11} while learning {one.training_return:6.1f}   afterwards, without stumbling {one.mean_return:6.1f}")

# %% [markdown]
# While it learns, SARSA gets more: it does not fall so often. Once nobody stumbles any more, Q-learning's way is the
# shorter one. To learn about the best way while one walks another is called **off-policy** (Q-learning), to learn
# about the way that one really walks **on-policy** (SARSA). Remember the two words: DQN and SAC are of the first
# kind, REINFORCE, A2C and PPO of the second.

# %% [markdown]
# ## Your turn
#
# **1. Bellman.** Write the right-hand side of his equation. `outcomes[a]` is a list of `(probability, next state,
# reward, is over)` for action `a`, `worth` holds a number for each state. Return the worth of the state. The check
# puts it in 400 times, with γ = 0.95, and compares with the solution.


# %% exercise bellman
def backup(outcomes, worth, gamma):
    best = []
    for action in outcomes:
        total = 0.0
        for probability, after, reward, is_over in outcomes[action]:
            total += probability * reward
        best.append(total)
    return max(best)


# %%
verdict = check("4.bellman", backup)
print(verdict)

# %% [markdown]
# **2. Q-learning.** Change `values[state, action]` in place. `terminated` says whether the step ended the episode for
# good.


# %% exercise update
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    values[state, action] = reward + gamma * values[successor].max()


# %%
verdict = check("4.update", update)
print(verdict)

# %% [markdown]
# **3. SARSA.** The same with the action that comes next.


# %% exercise sarsa
def update(values, state, action, reward, successor, next_action, terminated, alpha, gamma):
    pass


# %%
verdict = check("4.sarsa", update)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - **Bellman**: what a state is worth is the reward now plus γ times the worth of what comes.
# - With known rules one can **compute** the worth (dynamic programming); without them one **learns** it by walking, a
#   share of each surprise at a time.
# - **Q-learning** learns about the best way, **SARSA** about the way that it really walks.
#
# Next, such a table drives a car. Answer the quiz: `racecraft lessons quiz 4`.
