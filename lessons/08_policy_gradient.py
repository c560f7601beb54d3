# %% [markdown]
# # Lesson 8 · A policy without values
#
# **Goal.** You can write the policy gradient, explain what a baseline does to its variance, and say why it changes
# nothing on average.
#
# Until now we learned what actions are *worth*, and then took the best. It can be done without: give every action a
# **probability**, try, and make what went well likelier. That is a *policy gradient*.
#
# *Something that is often said wrongly:* that a policy gradient approximates the value function. It does not. The
# policy itself is what is changed, and no value is needed in order to act. A value may *help*, as we shall see: it
# takes away noise.

# %% [markdown]
# ## A row of slot machines, once more
#
# Three machines pay 10, 11 and 12 on average, give or take one. A preference for each becomes a probability:
#
# $$\pi(a) = \frac{e^{h_a}}{\sum_b e^{h_b}} \qquad\qquad h \leftarrow h + \alpha\,(r - b)\,\nabla \log \pi(a)$$
#
# The second is the whole of REINFORCE (Williams 1992). Without the **baseline** $b$ every pull is praised, since every
# machine pays something; the best one only a little more. Let us draw both gradients a few hundred times, at the same
# preferences.

# %%
import numpy as np

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.pictures import line_chart, scatter

PAYS = np.array([10.0, 11.0, 12.0])


def pulls(preferences, baseline, rng, count):
    """Estimates of the gradient by single pulls (count, 3)."""
    chances = np.exp(preferences) / np.exp(preferences).sum()
    actions = rng.choice(3, size=count, p=chances)
    rewards = PAYS[actions] + rng.normal(size=count)
    return (rewards - baseline)[:, None] * (np.eye(3)[actions] - chances)


rng = np.random.default_rng(1)
clouds = {name: pulls(np.zeros(3), b, rng, 20_000) for name, b in (("without baseline", 0.0), ("baseline 11", 11.0))}
for name, cloud in clouds.items():
    print(f"{name:17} mean {cloud.mean(axis=0).round(2)}, variance {cloud.var(axis=0).sum():6.1f}")
show(
    scatter(
        "The same mean, and ninety times the noise",
        {
            **{name: cloud[:300, [0, 2]] for name, cloud in clouds.items()},
            "mean of both": [clouds["baseline 11"].mean(axis=0)[[0, 2]]],
        },
        subtitle="Estimates of the gradient from one pull each: for the worst machine and for the best",
        x_label="worst machine",
        y_label="best machine",
    ),
    "two-clouds",
)

# %% [markdown]
# Both clouds have the same middle: **a baseline changes nothing on average**, since it does not depend on the action,
# and the probabilities sum to one whatever the preferences are. But one cloud is small enough to see from a few pulls
# where its middle is, and the other is not. What does that mean for learning?

# %%
PLAYERS, PULLS = 60, 300


def play(with_baseline):
    """Share of players that pull the best machine, pull by pull."""
    rng, best = np.random.default_rng(2), np.zeros(PULLS)
    for _ in range(PLAYERS):
        preferences, mean = np.zeros(3), 0.0
        for t in range(PULLS):
            chances = np.exp(preferences - preferences.max())
            chances /= chances.sum()
            best[t] += chances[2]
            action = rng.choice(3, p=chances)
            reward = PAYS[action] + rng.normal()
            mean += (reward - mean) / (t + 1)
            baseline = mean if with_baseline else 0.0
            preferences = preferences + 0.1 * (reward - baseline) * (np.eye(3)[action] - chances)
    return best / PLAYERS


shares = {"with baseline": play(True), "without": play(False)}
show(
    line_chart(
        "Praise only what is better than expected",
        shares,
        subtitle="Probability of the best machine, mean of 60 players; the baseline is the mean of what came so far",
        x_label="pulls",
        y_label="probability",
        y_range=(0.0, 1.0),
    ),
    "learning-with-and-without",
)
print({name: round(float(curve[-1]), 2) for name, curve in shares.items()})

# %% [markdown]
# Without a baseline the first machine that is pulled is praised with 10, and so is likelier to be pulled again, and
# praised again: most players get stuck with the one that they met first.

# %% [markdown]
# ## The pole, with a network
#
# On `CartPole-v1` the baseline is a network, too, which estimates what the rest of the episode will bring from here:
# a value function, but **only as a helper**. Three seeds each; without it, the mean return of the batch is subtracted.

# %%
curves = {
    name: [
        learn("CartPole-v1", "reinforce", seed=seed, until="20000 steps", settings=chosen).curve for seed in (1, 2, 3)
    ]
    for name, chosen in {"with a baseline network": {}, "with the mean only": {"has_baseline": False}}.items()
}
show(
    line_chart(
        "How long the pole stands",
        {
            name: ([steps for steps, _ in runs[0]], np.mean([[mean for _, mean in run] for run in runs], axis=0))
            for name, runs in curves.items()
        },
        subtitle="REINFORCE on CartPole-v1, greedy episodes on the way, mean of three seeds",
        x_label="steps of learning",
        y_label="steps that it stands",
        y_range=(0, 520),
    ),
    "pole",
)
for name, runs in curves.items():
    print(f"{name:23} after 15,000 steps {[round(dict(run)[15_000]) for run in runs]}")

# %% [markdown]
# No difference to be seen, with any of the three seeds: after 15,000 steps all of them balance the pole for all 500
# steps. The *mean of the batch* is a baseline already, and on a task as plain as this one it is enough. What took away
# ninety parts of the noise above was to have **a** baseline; how clever it is matters only where states differ much in
# what they are worth.

# %% plaything lap [markdown]
# *To play with:* this lesson's page in the console (`racecraft serve`, *Course*) has a policy that learns to drive a
# lap in this way. It shows the whole distribution: where its cars are, and how they steer. Look where it makes up its
# mind, and where it never does, since nothing depends on it.

# %% [markdown]
# ## Your turn
#
# **1. Returns.** `rewards` are those of one episode (T,). Give every step what came from it on: its own reward, the
# next one times `gamma`, the one after times `gamma`², and so on.


# %% exercise returns
def returns(rewards, gamma):
    return rewards


# %%
verdict = check("8.returns", returns)
print(verdict)

# %% [markdown]
# **2. A step.** `preferences` (A,) become probabilities as above. Action `action` was pulled and brought `reward`.
# Return the new preferences.


# %% exercise step
def step(preferences, action, reward, baseline, rate):
    return preferences


# %%
verdict = check("8.step", step)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - A policy gradient changes **probabilities** directly; it works for numbers as actions, too, where no table of
#   values could look for a maximum.
# - It is right on average and **noisy**; a baseline takes noise away and leaves the average alone.
# - It learns only from what the policy itself has just done (*on-policy*): every step is used once and thrown away.
#
# Who waits for an episode's end learns slowly. The next lesson does not wait. Answer the quiz:
# `racecraft lessons quiz 8`.
