# %% [markdown]
# # Lesson 3 · Explore or exploit?
#
# **Goal.** You can explain why a learner must sometimes do what it thinks is wrong, measure what that costs, and let
# the exploration fade.
#
# You are new in town and there are five restaurants. You went to one, and it was fine. Go there again, or try
# another? If you always go back, you may miss the best one for ever. If you always try something new, you eat badly
# most of your life. Every learner that lives on trial and error has this problem, and a racing car has it in every
# bend.
#
# - To **exploit** is to do what looks best so far.
# - To **explore** is to do something else, to find out.

# %% [markdown]
# ## Five slot machines
#
# The smallest world with this problem is a row of slot machines, in the literature a *multi-armed bandit*. Each
# machine pays a random amount around a mean that nobody tells us. There are no states and nothing to drive: only one
# choice, a thousand times.

# %%
import numpy as np

from racecraft.classic.q_table import epsilon_greedy
from racecraft.course import check, show
from racecraft.course.pictures import bar_chart, line_chart

MACHINES, PULLS, PLAYERS = 5, 1000, 400
rng = np.random.default_rng(3)
means = rng.normal(size=(PLAYERS, MACHINES))  # every player stands before five machines of its own

# %% [markdown]
# A player keeps two things per machine: how often it was pulled, and the **mean of what it paid**, its *value*. The
# mean can be kept without remembering all payments, by moving a little towards each new one:
#
# $$\text{value} \leftarrow \text{value} + \frac{1}{n}\,(\text{reward} - \text{value})$$
#
# The bracket is the *surprise*: what came, less what was expected. You will meet this line again in every lesson:
# nearly all of reinforcement learning is *old guess + a step × surprise*.
#
# And the player decides by **ε-greedy** (ε is the Greek letter epsilon): with probability ε a machine by lot,
# otherwise the one of the highest value. It is the very function that our Q-tables drive with.


# %%
def play(epsilon, seed=0):
    """What 400 players lose, pull by pull, against always pulling the best machine (1000,)."""
    rng = np.random.default_rng(seed)
    values, counts = np.zeros((PLAYERS, MACHINES)), np.zeros((PLAYERS, MACHINES))
    everyone, lost = np.arange(PLAYERS), []
    for pull in range(PULLS):
        now = epsilon(pull) if callable(epsilon) else epsilon
        chosen = epsilon_greedy(values, now, rng)
        rewards = means[everyone, chosen] + rng.normal(size=PLAYERS)
        counts[everyone, chosen] += 1
        values[everyone, chosen] += (rewards - values[everyone, chosen]) / counts[everyone, chosen]
        lost.append((means.max(axis=1) - means[everyone, chosen]).mean())
    return np.array(lost)


# %% [markdown]
# ## What a mistake costs: regret
#
# What a player lost because it did not always pull the best machine is called **regret**. Nobody can avoid it: one
# has to pull the bad ones to learn that they are bad. But how much of it is up to us.

# %%
curves = {
    "ε = 0, never explores": np.cumsum(play(0.0)),
    "ε = 0.01": np.cumsum(play(0.01)),
    "ε = 0.1": np.cumsum(play(0.1)),
    "ε = 0.5": np.cumsum(play(0.5)),
}
show(
    line_chart(
        "What was lost so far",
        curves,
        subtitle="Mean of 400 players: a steep line loses with every pull, a flat one has found the best machine",
        x_label="pulls",
        y_label="regret",
    ),
    "regret",
)
for name, curve in curves.items():
    print(f"{name:24} {curve[-1]:5.0f}")

# %% [markdown]
# Read it slowly, there is a lot in it:
#
# - **ε = 0** rises as a straight line. It fell in love with the first machine that paid, and loses the same with
#   every pull, for ever.
# - **ε = 0.5** soon knows the best machine, and throws half of its pulls away all the same.
# - **ε = 0.01** is slow: it takes hundreds of pulls until it has found out. But look how flat it becomes.
# - **ε = 0.1** is the best of these *after a thousand pulls*. After a hundred thousand it would not be: it goes on
#   losing a tenth of its pulls, always.
#
# Now all ε, and what they lost in the end:

# %%
epsilons = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.075, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5])
losses = [play(epsilon).sum() for epsilon in epsilons]
fading = play(lambda pull: 10.0 / (10.0 + pull)).sum()
show(
    line_chart(
        "Too little is bad, and too much is bad",
        {"a constant ε": (epsilons, losses)},
        subtitle="Regret after 1000 pulls against the share of pulls that are drawn by lot",
        x_label="epsilon",
        y_label="regret",
        marks={"an ε that fades": fading},
    ),
    "regret-against-epsilon",
)
print(f"The best constant ε loses {min(losses):.0f}, at ε = {epsilons[int(np.argmin(losses))]:g}.")
print(f"One that fades, 10 / (10 + pulls), loses {fading:.0f}.")

# %% plaything bandit [markdown]
# *To play with:* this lesson's page in the console (`racecraft serve`, *Course*) has five such machines. Pull them
# yourself, then let ε-greedy pull, and compare the regret.

# %% [markdown]
# ## Explore early, exploit late
#
# Curiosity is worth most at the beginning, when little is known and there is much time left to use what one finds. So
# good learners let exploration **fade**. The dashed line is an ε of 1 at first and of 10 / (10 + pulls) later; it
# beats every constant.
#
# Our cars do the same. Q-learning begins with ε = 1 (everything by lot) and lets it fall; PPO, which drove the cars
# of lesson 1, chooses its actions by lot with odds that it learns itself, and becomes surer with time.
#
# Another idea needs no lot at all: be an **optimist**. Begin with values that are much too high, and always take the
# best. Every machine then disappoints when it is tried, so that the next one looks better, until all have been tried.

# %%
everyone = np.arange(PLAYERS)


def play_optimist(hope):
    """Greedy, with values that begin at `hope` as if each machine had paid it a few times."""
    rng = np.random.default_rng(0)
    values, counts = np.full((PLAYERS, MACHINES), hope), np.full((PLAYERS, MACHINES), 3.0)
    lost = 0.0
    for _ in range(PULLS):
        chosen = values.argmax(axis=1)
        rewards = means[everyone, chosen] + rng.normal(size=PLAYERS)
        counts[everyone, chosen] += 1
        values[everyone, chosen] += (rewards - values[everyone, chosen]) / counts[everyone, chosen]
        lost += (means.max(axis=1) - means[everyone, chosen]).mean()
    return lost


show(
    bar_chart(
        "Four ways to play",
        {
            "never explores": curves["ε = 0, never explores"][-1],
            "ε = 0.1": curves["ε = 0.1"][-1],
            "ε that fades": fading,
            "greedy optimist": play_optimist(3.0),
        },
        subtitle="Regret after 1000 pulls, less is better",
        digits=0,
    ),
    "four-ways",
)

# %% [markdown]
# ## Your turn
#
# Write `choose`: given the values (mean payment so far, 0 for a machine never pulled), the counts (pulls so far) and
# a generator of random numbers, return the number of the machine to pull next. The check lets 60 players pull 600
# times each, and wants a regret of at most 70. A constant ε does not reach that.


# %% exercise choose
def choose(values, counts, rng):
    if rng.random() < 0.5:
        return int(rng.integers(len(values)))
    return int(values.argmax())


# %%
verdict = check("3.choose", choose)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - A learner must **explore**, or it settles for the first thing that works; that is as true of a racing line as of a
#   slot machine.
# - **Regret** says what learning cost. Too little curiosity and too much both cost dearly.
# - Curiosity should **fade** as knowledge grows.
#
# In a slot machine a choice changes nothing but the payment. On a road it also changes *where one is next*. That
# makes the next lesson.
#
# Answer the quiz: `racecraft lessons quiz 3`.
