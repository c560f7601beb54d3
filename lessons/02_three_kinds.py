# %% [markdown]
# # Lesson 2 · Three ways to learn
#
# **Goal.** You can tell supervised, unsupervised and reinforcement learning apart by what the learner is told, and
# build a small example of each.
#
# Machines learn in three ways. They differ in one thing: **what the learner is told.**
#
# | | it is told | example |
# |---|---|---|
# | supervised | the right answer to every question | *here the expert steered 12° to the left* |
# | unsupervised | nothing; it looks for order by itself | *these pictures look alike* |
# | reinforcement | how good what it did was, never what would have been right | *that was worth 0.8* |
#
# All three in one lesson, with the same car.

# %% [markdown]
# ## Supervised: imitate a driver
#
# An expert drives: an autopilot that knows the road exactly. We write down what it saw and how it steered; two
# thousand questions with their answers. The expert's hand trembles a little while we watch, so that it also shows how
# it comes back from where it should not be.

# %%
import numpy as np

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.driving import drive
from racecraft.course.frames import small, taken
from racecraft.course.pictures import bar_chart, image_rows, scatter
from racecraft.race import Autopilot

OFFSET, SINE, BEND = 4, 5, 10  # columns of the state: place across the road, angle to it, bend ahead
expert, rng = Autopilot(speed=1.0), np.random.default_rng(2)
seen, steered = [], []


def trembling(state):
    commands = expert(state)
    seen.append(state[:, [OFFSET, SINE, BEND]])
    steered.append(commands[:, 0])
    trembled = commands.copy()
    trembled[:, 0] += rng.normal(0.0, 0.25, len(state))
    return trembled


drive(trembling, cars=12, seconds=12.0)
questions = np.column_stack([np.concatenate(seen), np.ones(sum(map(len, seen)))])
answers = np.concatenate(steered)
print(f"{len(answers):,} questions with answers.")

# %% [markdown]
# The learner is the simplest there is: steering = a · place + b · angle + c · bend + d, with the four numbers for
# which the sum of the squared mistakes is smallest. It learns from the first half, and is examined on the second
# half, which it has **not** seen: whoever examines on what was learned by heart measures memory.

# %%
half = len(answers) // 2
weights, *_ = np.linalg.lstsq(questions[:half], answers[:half], rcond=None)
guesses = questions[half:] @ weights
mistake = np.degrees(np.abs(guesses - answers[half:]).mean())
print("weights:", np.round(weights, 3), f"  mean mistake on unseen questions: {mistake:.1f} degrees")
sample = rng.choice(len(guesses), 500, replace=False)
show(
    scatter(
        "A pupil and its expert",
        {"500 unseen questions": np.degrees(np.column_stack([answers[half:], guesses]))[sample]},
        subtitle="Steering in degrees, left positive: on the diagonal the pupil answers as the expert does",
        x_label="the expert's answer",
        y_label="the pupil's guess",
    ),
    "pupil-and-expert",
)


def pupil(state):
    features = np.column_stack([state[:, [OFFSET, SINE, BEND]], np.ones(len(state))])
    return np.column_stack([features @ weights, np.full(len(state), 1.0)])


imitated = drive(pupil, cars=20, seconds=60.0)
print(f"It drives: {imitated.laps} of 20 laps. It never heard of rewards.")

# %% [markdown]
# Four numbers drive a car, because somebody knew the answers. That is the strength of supervised learning, and its
# limit: the pupil can hardly become better than its expert, and without an expert there is nothing to learn from.

# %% [markdown]
# ## Unsupervised: order in a pile of pictures
#
# Now 200 pictures from the car's camera, and not a word about any of them. What can one learn from that? Which ones
# **resemble each other**. The method is called *k-means*: choose k centres, give every picture to the nearest centre,
# move each centre to the mean of its pictures, and repeat.

# %%
N, K = 200, 4
images = taken("oval", rng.uniform(0, 1, N), rng.normal(0.0, 0.1, N), rng.normal(0.0, 0.25, N))
points = small(images).reshape(N, -1)  # 192 numbers for each picture

centres = points[rng.choice(N, K, replace=False)]
for _ in range(20):
    distances = ((points[:, None] - centres) ** 2).sum(axis=-1)  # (N, K)
    nearest = distances.argmin(axis=1)
    centres = np.stack([points[nearest == k].mean(axis=0) for k in range(K)])

show(
    image_rows(
        "Four kinds of pictures, found without a word",
        {f"group {k + 1}": list(images[np.argsort(distances[:, k])[:6]]) for k in range(K)},
        subtitle="The six pictures nearest to each centre, as the car's camera took them",
    ),
    "four-groups",
)
print("Pictures in the groups:", np.bincount(nearest, minlength=K).tolist())

# %% [markdown]
# Look at the rows: the groups differ in where the road goes. Nobody told the machine that there are bends, and it
# does not know now: it has found groups, and giving them **names** is left to us.

# %% [markdown]
# ## Find the odd one
#
# Whoever knows what is ordinary can also see what is not. Here one of twelve cars stands across the road. Which
# picture differs most from the mean of all?

# %%
turns = rng.normal(0.0, 0.05, 12)
turns[7] = 1.3
pile = taken("oval", rng.uniform(0.0, 1.0, 12), np.zeros(12), turns)
strange = ((small(pile) - small(pile).mean(axis=0)) ** 2).sum(axis=(1, 2))
row, place = divmod(int(strange.argmax()), 6)
show(
    image_rows(
        "Which one does not belong?",
        {"0 to 5": list(pile[:6]), "6 to 11": list(pile[6:])},
        framed={("0 to 5", "6 to 11")[row]: place},
        subtitle="Framed: the picture that is farthest from the mean of all twelve",
    ),
    "the-odd-one",
)
print(f"Picture {strange.argmax()} is the odd one.")

# %% [markdown]
# ## Reinforcement: nobody knows the answer
#
# Often there is neither an expert nor any use for groups. Nobody can say how many degrees would have been *right* at
# the exit of a bend; but anybody can measure how quick the lap was. So the learner tries, and is told how good it
# was. The same car again, with nothing but rewards for being in the middle:

# %%
rewarded = learn("racecraft:Racecraft-v0", "q-table", seed=1)
tried = drive(rewarded, cars=20, seconds=60.0)
show(
    bar_chart(
        "Two ways to the same laps",
        {
            "told the answers": imitated.laps,
            "told how good it was": tried.laps,
        },
        subtitle=f"Laps of 20: from {half:,} answers of an expert, and from {rewarded.steps:,} rewarded attempts",
        digits=0,
    ),
    "two-ways",
)

# %% [markdown]
# Attempts are many and cheap, answers few and dear. Reinforcement learning needs many times as many steps, since a
# reward says so much less than an answer. In exchange it needs no expert, and can become better than everybody who
# ever drove.

# %% [markdown]
# ## Your turn
#
# Write `odd_one`: given a pile of small pictures, `images` (40, 12, 16), return the place of the one that does not
# belong. The check has eight piles, with the odd one always elsewhere; seven must be found.


# %% exercise odd
def odd_one(images):
    return 0


# %%
verdict = check("2.odd", odd_one)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - **Supervised**: every question has an answer. **Unsupervised**: there are only questions. **Reinforcement**: one
#   hears how good it was.
# - Examine a learner on what it has **not** seen.
# - A reward says less than an answer; so reinforcement learning needs many attempts, and no expert.
#
# Answer the quiz: `racecraft lessons quiz 2`.
