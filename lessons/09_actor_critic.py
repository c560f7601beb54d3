# %% [markdown]
# # Lesson 9 · Actor and critic
#
# **Goal.** You can say what a critic gives an actor, choose between believing it at once and waiting, and explain what
# changes when several processes learn at the same time.
#
# REINFORCE waits until the pole has fallen, and then praises everything that came before. A football player would not
# wait for the end of the season. An **actor** decides; a **critic** says after every step how things stand. Its news
# is the surprise, in which you will know Bellman's equation again:
#
# $$\delta = r + \gamma V(s') - V(s)$$

# %% [markdown]
# ## To believe or to wait
#
# How much is an action worth? There are two ways to ask. *Believe the critic*: one step really happened, the rest is
# its opinion. That is little noise, and wrong as long as the critic is. *Wait*: take what really came, as REINFORCE
# does. That is right on average, and noisy. Between them lies λ (Schulman and others, 2016, "GAE"):
#
# $$A = \delta_0 + \gamma\lambda\,\delta_1 + (\gamma\lambda)^2\,\delta_2 + \dots$$
#
# λ = 0 believes at once, λ = 1 waits. Here is how much a step counts that comes so much later:

# %%
import numpy as np

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.pictures import bar_chart, line_chart

GAMMA = 0.99
show(
    line_chart(
        "How far a surprise is heard",
        {f"λ = {lam:g}": (GAMMA * lam) ** np.arange(41.0) for lam in (0.0, 0.5, 0.9, 0.95, 1.0)},
        subtitle="Weight of a surprise that comes so many steps later, γ = 0.99",
        x_label="steps later",
        y_label="weight",
        y_range=(0.0, 1.02),
    ),
    "weights",
)

# %% [markdown]
# And learning? A2C plays sixteen poles at once and improves after every 8 steps. Three seeds each:

# %%
learned = {
    lam: [
        learn("CartPole-v1", "a2c", seed=seed, until="20000 steps", settings={"gae_lambda": lam}) for seed in (1, 2, 3)
    ]
    for lam in (0.0, 0.95, 1.0)
}
show(
    bar_chart(
        "Who believes a critic that knows nothing learns nothing",
        {f"λ = {lam:g}": float(np.mean([m for run in runs for _, m in run.curve])) for lam, runs in learned.items()},
        subtitle="Steps that the pole stands, mean of all evaluations in 20,000 steps and of three seeds",
        digits=0,
    ),
    "believing",
)
for lam, runs in learned.items():
    print(f"λ = {lam:4g}: after 20,000 steps {[round(run.curve[-1][1]) for run in runs]}")

# %% [markdown]
# With λ = 0 the pole falls after 9 to 15 steps even after 20,000 steps of learning, with each of the three seeds: the
# actor believes a critic that knows nothing yet, and *whose* fault a fall was does not get back to the steps that
# caused it. With 0.95 and with 1 it stands for more than a hundred. Between those two there is no winner in three
# seeds: 500, 113, 114 against 358, 115, 129 at the end.

# %% plaything gae [markdown]
# *To play with:* this lesson's page in the console (`racecraft serve`, *Course*) has eight surprises to drag. At λ = 0
# the line lies on them; the nearer λ comes to 1, the further back the last one is heard.

# %% [markdown]
# ## A3C: nobody waits
#
# One processor plays, the others look on: a pity. **A3C** (Mnih and others, 2016) starts several processes. Each plays
# poles of its own, works out in which direction the weights should go, and changes the *common* weights, whatever the
# others have done to them in between. Two things come of it.
#
# **First, no two runs are alike.** In what order the processes arrive is the operating system's affair. Here are A2C
# and A3C, each twice, with the very same seed:

# %%
twice = {
    name: [learn("CartPole-v1", name, seed=1, until="20000 steps").returns for _ in range(2)] for name in ("a2c", "a3c")
}
for name, (first, second) in twice.items():
    both = min(len(first), len(second))
    same = sum(a == b for a, b in zip(first[:both], second[:both], strict=True))
    print(f"{name}: {len(first)} and {len(second)} episodes, of which {same} of the first {both} are alike")

# %% [markdown]
# A2C repeats itself to the last bit, and a mistake can be looked for. With A3C one looks for it in a run that will
# never come again.
#
# **Second, what a process finds out is old when it arrives.** How bad is that? Let a ball roll down into a valley,
# by a gradient that is so many steps old:


# %%
def roll(delay, rate=0.12, steps=60):
    """Height of a ball in the valley x², when its gradient is some steps old."""
    places = [1.0] * (delay + 1)
    for _ in range(steps):
        places.append(places[-1] - rate * 2.0 * places[-1 - delay])
    return np.abs(places[delay:])


show(
    line_chart(
        "Old news",
        {f"{delay} steps old": np.minimum(roll(delay), 2.0) for delay in (0, 2, 4, 8)},
        subtitle="Distance from the bottom of a valley, by steps; the same step size, only the gradient is older",
        x_label="steps",
        y_label="distance from the bottom",
        y_range=(0.0, 2.0),
    ),
    "old-news",
)
print({delay: round(float(roll(delay)[-8:].max()), 4) for delay in (0, 2, 4, 8)})

# %% [markdown]
# Up to a certain age it does nothing, then the ball swings, and then it flies out of the valley. The remedy is a
# smaller step, so that is the price of asynchrony: **no waiting, but smaller steps, and no repetition.** That is why
# hardly anybody uses A3C today: many worlds in one batch (A2C, PPO) keep a processor as busy, and they repeat.

# %% [markdown]
# ## Your turn: the advantage
#
# `rewards`, `values` (of the states the steps began in), `afterwards` (of the states they led to) and `terminated` are
# of one world (T,). Return the advantage of each step, going backwards.


# %% exercise advantages
def advantages(rewards, values, afterwards, terminated, gamma, lam):
    return rewards - values


# %%
verdict = check("9.advantages", advantages)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - The **critic** judges every step; the actor need not wait for the end.
# - **λ** says how far to believe it: little noise and a bias, or no bias and noise. 0.95 is a good beginning.
# - **A2C** plays many worlds in step and repeats exactly. **A3C** lets processes run free: no waiting, stale gradients,
#   and no two runs alike.
#
# Both throw a step away after one use. The next lesson uses it several times, carefully. Answer the quiz:
# `racecraft lessons quiz 9`.
