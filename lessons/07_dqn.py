# %% [markdown]
# # Lesson 7 · A network instead of the table
#
# **Goal.** You can explain why Q-learning with a network falls apart, what replay and a target network do about it,
# and find out by switching them off which of them matters.
#
# A table needs a cell for every state. A pole on a cart has four numbers, and no two moments are quite alike. A
# **network** takes the four numbers and gives a value for each action, also where it has never been: it
# *generalises*. That is the gain, and the trouble, too: whoever changes it in one place changes it everywhere.

# %% [markdown]
# ## The pole
#
# `CartPole-v1`: push the cart to the left or to the right so that the pole on it does not fall. Every step pays 1; an
# episode ends when the pole falls, and is cut off after 500 steps.
#
# Here is what a table that is not there would move towards, and a network is trained to say:
#
# $$y = r + \gamma \max_{a'} Q(s', a') \qquad \text{loss} = \big(y - Q(s, a)\big)^2$$
#
# It looks like a lesson with right answers. It is none: **the right answers come from the pupil**, and change with
# everything it learns. And what it is shown one after the other is nearly the same: a second of the same pole. Two
# tricks made it work in 2013 and 2015 (Mnih and others, DQN):
#
# - **Replay.** Steps go into a memory, and are drawn from it in random order. So a batch holds good moments and bad
#   ones, old and new, and nothing is forgotten while the pole just stands.
# - **Target network.** The future is asked of a copy of the network that stands still, and is brought up to date only
#   now and then. So the answers hold for a while.
#
# `src/racecraft/classic/dqn.py` is all of it, in little more than a hundred lines. Its settings can switch both off.

# %%
import numpy as np

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.pictures import bar_chart, line_chart

NO_REPLAY = {"memory": 64, "warm_up": 64}  # the memory holds one batch: the last 64 steps, nothing older
NO_TARGET = {"target_every": 1}  # the copy is brought up to date after every update
LEARNERS = {
    "with both": {},
    "without replay": NO_REPLAY,
    "without target": NO_TARGET,
}
learned = {
    name: [learn("CartPole-v1", "dqn", seed=seed, until="12500 steps", settings=settings) for seed in (1, 2, 3)]
    for name, settings in LEARNERS.items()
}

# %% [markdown]
# Now and then each learner plays 20 episodes without exploring. So long the pole stood, mean of three seeds:

# %%
show(
    line_chart(
        "What holds a network together",
        {
            name: ([steps for steps, _ in runs[0].curve], np.mean([[m for _, m in run.curve] for run in runs], axis=0))
            for name, runs in learned.items()
        },
        subtitle="Steps that the pole stands without exploration, while it is learned; mean of three seeds",
        x_label="steps of learning",
        y_label="steps that it stands",
        y_range=(0, 520),
    ),
    "with-and-without",
)

# %%
show(
    bar_chart(
        "How good the last ones were",
        {name: float(np.mean([run.curve[-1][1] for run in runs])) for name, runs in learned.items()},
        subtitle="Steps that the pole stands at the end of learning, 500 at most; mean of three seeds",
        digits=0,
    ),
    "at-the-end",
)
print({name: [round(run.curve[-1][1]) for run in runs] for name, runs in learned.items()})

# %% [markdown]
# **Without a target network nothing is learned at all**: the pole falls after 9 or 10 steps, with each of the three
# seeds, which is what one gets for always pushing to the same side. Every update raises the very answer that it is
# compared with, and all values run away together.
#
# **Without replay: no difference to be seen here.** That is not what the books say. Four poles are played at once, so
# even the last 64 steps hold moments of four kinds, and the pole forgives. Replay shows its worth where something
# happens seldom, as on the mountain of lesson 6: a flag that was reached once in a thousand episodes is looked at again
# and again. A trick that everybody praises is not needed everywhere; **one finds out by switching it off**.
#
# Three seeds are few, and curves of DQN jump. Never believe one curve: run it again with other seeds before you say
# what a setting does.

# %% [markdown]
# ## A quiet trap: the size of rewards
#
# DQN does not square a large surprise: a surprise of 50 would tear the network apart. It is **clipped** to 1 (Huber's
# loss). But here a pole that stands is worth up to 100, and the news that it falls is a surprise of -99, which pulls
# no harder than -1. So our settings multiply rewards by 0.02. Nothing else about the task has changed: the best
# policy stays the best one.
#
# It is also a good moment to put something right that is often told of `MountainCar-v0`, where the car must swing to
# get up to a flag: **the flag pays nothing.** Every step costs 1, and reaching it ends the cost; that is why the best
# scores are about -100. Until the first time up there all rewards are alike, and a learner that explores step by step
# practically never gets there. Ours keeps an action that was drawn by lot for up to 30 steps.

# %% [markdown]
# ## Your turn
#
# **1. The answers.** Write what the network is trained to say for a batch of steps. `rewards` and `terminated` have
# a value for each step (B,), `online` and `target` the values that the two networks see in the *next* states (B,
# actions). `terminated` says whether the step ended the episode for good.


# %% exercise targets
def targets(rewards, terminated, online, target, gamma):
    return rewards


# %%
verdict = check("7.targets", targets)
print(verdict)

# %% [markdown]
# **2. The memory.** `memory` is a list. Put a step in; when there are more than `capacity`, one must go. Change the
# list in place.


# %% exercise remember
def remember(memory, step, capacity):
    pass


# %%
verdict = check("7.remember", remember)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - A network **generalises**, so an update for one state moves all others.
# - **Replay** breaks up what comes one after the other, and uses every step often. It needs an *off-policy* learner:
#   old steps were made by an older, worse driver.
# - The **target network** holds the answers still for a while.
#
# Next, a policy without any values. Answer the quiz: `racecraft lessons quiz 7`.
