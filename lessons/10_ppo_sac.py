# %% [markdown]
# # Lesson 10 · PPO and SAC
#
# **Goal.** You can explain what PPO's clip and SAC's entropy are for, and find a bug in a learner that learns all the
# same.
#
# A2C uses every step once. To use it ten times would be ten times cheaper. But after the first time the policy is
# another one, and the steps tell of the old one. **PPO** (Schulman and others, 2017) asks how much likelier an action
# has become since it was played, the *ratio*, and stops praising when that goes too far:
#
# $$\min\big(\text{ratio} \cdot A,\; \text{clip}(\text{ratio}, 1-\varepsilon, 1+\varepsilon) \cdot A\big)$$

# %%
import numpy as np

from racecraft.classic import learn, rollout
from racecraft.course import check, show
from racecraft.course.pictures import line_chart

CLIP = 0.2
ratios = np.linspace(0.0, 2.0, 201)
show(
    line_chart(
        "What PPO wants to be large",
        {
            "good action, A = 1": (ratios, np.minimum(ratios, np.clip(ratios, 1 - CLIP, 1 + CLIP))),
            "bad action, A = -1": (ratios, np.minimum(-ratios, -np.clip(ratios, 1 - CLIP, 1 + CLIP))),
        },
        subtitle="Gain by how much likelier the action has become; where the line is flat, nothing pulls any more",
        x_label="ratio: new probability over old",
        y_label="gain",
    ),
    "clip",
)

# %% [markdown]
# Look at the two flat pieces, and at the two that are *not* flat: a good action that has become unlikely may come
# back, and a bad one that has become likelier is mended with full force. Does it matter? Every rollout is used twenty
# times here, with a large step size, once with ε = 0.2 and once with ε = 1, which holds hardly anything:

# %%
HASTY = {"epochs": 20, "learning_rate": 3e-3}
curves = {
    name: [
        learn("CartPole-v1", "ppo", seed=seed, until="20000 steps", settings={**HASTY, **more}).curve
        for seed in (1, 2, 3)
    ]
    for name, more in {"with clip, ε = 0.2": {}, "hardly any, ε = 1": {"clip": 1.0}}.items()
}


def mean_curve(runs):
    """Steps, and mean of the seeds."""
    return [steps for steps, _ in runs[0]], np.mean([[mean for _, mean in run] for run in runs], axis=0)


show(
    line_chart(
        "Twenty times the same steps",
        {name: mean_curve(runs) for name, runs in curves.items()},
        subtitle="PPO on CartPole-v1, greedy episodes on the way, mean of three seeds",
        x_label="steps of learning",
        y_label="steps that the pole stands",
        y_range=(0, 520),
    ),
    "with-and-without-clip",
)
for name, runs in curves.items():
    print(f"{name:20} lowest of all evaluations: {min(mean for run in runs for _, mean in run):.0f}")

# %% [markdown]
# With the clip no evaluation fell below 491 of 500. Without, one of the three seeds stood at 139 steps, then at **18**,
# before it recovered: it had believed old news until nothing was left of what it could. At the end all of them stand
# for 500 steps. The clip does not make the best better; it keeps the way there from breaking off.

# %% plaything clip [markdown]
# *To play with:* this lesson's page in the console (`racecraft serve`, *Course*) has the two curves to drag a ratio
# along. For a bad action the flat part is on the other side.

# %% [markdown]
# ## SAC: earn much, and stay undecided
#
# PPO must play on-policy. **SAC** (Haarnoja and others, 2018) is for actions that are numbers, such as a steering
# angle, and replays old steps as DQN does. It adds to the reward what the policy keeps open, its **entropy**, times a
# factor α. The best that can be done then is no maximum, but a distribution:
#
# $$\pi(a) \propto e^{Q(a) / \alpha}$$
#
# Suppose two ways around an obstacle are nearly as good. What does the policy do?

# %%
angles = np.linspace(-1.0, 1.0, 201)
worth = np.exp(-(((angles + 0.5) / 0.15) ** 2)) + 0.95 * np.exp(-(((angles - 0.5) / 0.15) ** 2))
policies = {}
for alpha in (0.02, 0.1, 0.5):
    chances = np.exp((worth - worth.max()) / alpha)
    policies[f"α = {alpha:g}"] = (angles, chances / chances.sum() / (angles[1] - angles[0]))
show(
    line_chart(
        "Two ways around an obstacle",
        {"worth of the angle": (angles, worth), **policies},
        subtitle="Where a policy steers that weighs entropy with α; the left way is worth 1, the right one 0.95",
        x_label="steering",
        y_label="worth, and density of the policy",
    ),
    "entropy",
)
for name, (_, density) in policies.items():
    print(f"{name}: goes right in {100 * density[angles > 0].sum() / density.sum():.0f} of 100 cases")

# %% [markdown]
# With a small α it has decided, with a large one it keeps both ways open, and finds out if the worth was wrong. SAC
# chooses α itself, so that a given entropy remains. On the pendulum that must swing up (who pushes
# by lot earns about -1,200, one that only hangs -1,974):

# %%
swing = learn("Pendulum-v1", "sac", seed=1, until="4000 steps")
print(f"SAC after {swing.steps:,} steps: return {swing.mean_return:.0f}, in {swing.learning_seconds:.0f} s")

# %% [markdown]
# ## Find the bug
#
# In an ordinary program a bug shows: it stops, or the answer is wrong. A learner with a bug often **learns all the
# same**, only worse, and says nothing. Here is one that was planted. `accumulate` makes advantages out of surprises
# (T, N), for T steps of N worlds:


# %%
def planted(surprise, is_over, fade):
    advantages, following = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = surprise[t] + fade * following
        advantages[t] = following
    return advantages


sound = rollout.accumulate
rollout.accumulate = planted
broken = [learn("CartPole-v1", "ppo", seed=seed, until="20000 steps", settings=HASTY).curve for seed in (1, 2, 3)]
rollout.accumulate = sound
runs = {"as it should be": curves["with clip, ε = 0.2"], "with the bug": broken}
show(
    line_chart(
        "Which one has the bug?",
        {name: mean_curve(curves_of) for name, curves_of in runs.items()},
        subtitle="The same PPO, one line apart; mean of three seeds",
        x_label="steps of learning",
        y_label="steps that the pole stands",
        y_range=(0, 520),
    ),
    "bug",
)

# %% [markdown]
# You cannot tell. Both reach 500 of 500 with each of three seeds, and on `Acrobot-v1`, too, all three seeds of both
# passed -100 within 40,000 steps. **The curve does not show the bug.** It will show another day, on another task, and
# then nobody knows where to look.
#
# How does one find such a thing? Not by looking at curves. **Check the parts**: a few numbers by hand, an episode that
# ends in the middle, a gradient against finite differences. Our own tests do exactly that, and each of them was seen
# to fail once with a bug planted on purpose.

# %% [markdown]
# ## Your turn
#
# **1. The gain.** `ratio` and `advantage` are arrays of the same length. Return what PPO makes large, for each step.


# %% exercise gain
def gain(ratio, advantage, clip):
    return advantage


# %%
verdict = check("10.gain", gain)
print(verdict)

# %% [markdown]
# **2. The repair.** `is_over` (T, N) says where an episode ended with a step. Mend `planted` from above.


# %% exercise repair
def accumulate(surprise, is_over, fade):
    advantages, following = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for t in reversed(range(len(surprise))):
        following = surprise[t] + fade * following
        advantages[t] = following
    return advantages


# %%
verdict = check("10.repair", accumulate)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - **PPO** uses every step several times; the **clip** keeps it from believing old news too long.
# - **SAC** replays, is made for numbers as actions, and holds **entropy** up: it decides no sooner than it must.
# - Learners with **bugs learn**. Check the parts, not the curve.
#
# PPO is what our cars learn with. The next lesson looks through their camera. Answer the quiz:
# `racecraft lessons quiz 10`.
