# %% [markdown]
# # Lesson 1 · Reward drives behaviour
#
# **Goal.** You can say what a reward function is, predict what a car will make of it, and repair one that goes wrong.
#
# A dog is not told *how* to sit. It tries this and that, and gets a biscuit when it sits. Reinforcement learning
# teaches machines the same way: nobody writes down how to steer. We only write down what is worth a biscuit, and let
# the machine find out by trial and error how to get many. The biscuit is a number, the **reward**, and it is all that
# the learner ever hears from us.
#
# Fifteen times a second this happens:
#
# 1. the car **observes** where it is,
# 2. it chooses an **action**: a steering angle and a speed,
# 3. the world moves on, and the car gets a **reward**.
#
# From one start to the end (a lap, or a trip into the grass) is an **episode**. The learner wants as much reward over
# an episode as it can get. That is its only wish; it knows nothing of racing.

# %% [markdown]
# ## A car learns in a few seconds
#
# Here is a reward function. It looks like every one you will write: a function of `params`, a dictionary that tells
# where the car is and what it does, returning a number.

# %%
def good_reward(params):
    if params["is_offtrack"]:
        return -1.0
    half_width = 0.5 * params["track_width"]
    centred = 1.0 - params["distance_from_center"] / half_width  # 1 in the middle, 0 at the edge
    return params["speed"] * max(centred, 0.1)


# %% [markdown]
# And here a car learns with it. At first it knows nothing and rolls off the road; 100,000 steps later (two hours of
# driving, but 64 cars drive at once and time runs fast) it drives laps.

# %%
import time

from racecraft.classic import learn
from racecraft.course import check, show
from racecraft.course.drivers import earnings
from racecraft.course.driving import drive
from racecraft.course.pictures import bar_chart, drawn_lines, film


def teach(reward, action_space="default"):
    """A car learns to drive on the oval from a few numbers: where it is, how it stands, how the road bends."""
    return learn(
        "racecraft:Racecraft-v0",
        "ppo",
        seed=1,
        make={"track": "oval", "reward": reward, "action_space": action_space, "max_episode_steps": 300},
        settings={"num_envs": 64, "batch": 512},
        until="100000 steps",
    )


begun = time.perf_counter()
good = teach(good_reward)
print(f"It learned for {good.learning_seconds:.1f} s; with looking how it does, {time.perf_counter() - begun:.1f} s.")

good_drives = drive(good)
print(f"{good_drives.laps} of 12 laps, {good_drives.lap_seconds:.1f} s each.")

# %% [markdown]
# *Something that is often said wrongly:* rewards are **not** computed from what the camera sees. The simulator knows
# the truth (position, speed, borders), and the reward is computed from that. Observation and reward are two separate
# things: what the car may know, and what it is paid for. This is also why a car in the real world drives without a
# reward: it has learned, and nobody needs to pay it any more.

# %% [markdown]
# ## It does what you pay for, not what you mean
#
# Four people wrote a reward each. All four sound sensible. Read them, and guess what the cars will do.


# %%
def inside(params):
    """'The main thing is that it stays on the road.'"""
    return 1.0 if params["all_wheels_on_track"] else 0.001


def overwritten(params):
    """'Keep to the middle, and be quick.'"""
    reward = 0.001
    if params["distance_from_center"] < 0.25 * params["track_width"]:
        reward = 1.0
    reward = params["speed"]
    return reward


def zigzag(params):
    """'A good driver steers a lot, on the road of course.'"""
    return abs(params["steering_angle"]) / 30.0 if params["all_wheels_on_track"] else 0.001


def cliff(params):
    """'No half measures: 3 m/s or nothing.'"""
    return 1.0 if params["speed"] >= 3.0 else 0.001


# %%
drives = {"a good reward": good_drives}
for name, reward in {"inside": inside, "overwritten": overwritten, "zigzag": zigzag}.items():
    drives[name] = drive(teach(reward))
drives["cliff, up to 4 m/s"] = drive(teach(cliff, "fast"))

show(
    drawn_lines(
        "Five rewards, five drivers",
        drives,
        subtitle="Lines of 3 of 12 cars; the brighter, the faster; a red dot: off the road",
    ),
    "five-rewards",
)

# %% [markdown]
# Every one of these cars is a perfect learner. Each earns nearly all that its reward can pay:
#
# - **inside** strolls around at the lowest speed that it has. Nobody pays for hurry.
# - **overwritten** is quick, but wide: `reward = params["speed"]` throws away what was computed before it.
# - **zigzag** swings its wheels from stop to stop, all the way round.
# - **cliff** drives 4 m/s into the grass. Below 3 m/s every speed is worth the same nothing, so there is no way to
#   learn to be *a little* faster, and whoever is fast enough to earn something is too fast for the bend.
#
# Watch two of them (half of all pictures are left out, and time runs twice as fast):

# %%
show(film("Calm and restless", {"good": good_drives, "zigzag": drives["zigzag"]}, seconds=6.0), "calm-and-restless")

# %% [markdown]
# ## Ask before you train: whom does it like best?
#
# One need not train to see this coming. Take drivers whose habits are known, let each drive for ten seconds, and look
# at **what the reward pays them in a second**. A learner will become like the one who earns most.

# %%
show(
    bar_chart(
        "What 'inside' pays",
        earnings(inside),
        subtitle="Reward in a second of driving: slow to quick hold 0.5, 1, 1.5 and 2 m/s",
        highlighted=["slow", "quick"],
    ),
    "inside-pays",
)

# %% [markdown]
# The slow one and the quick one earn the same: here is the fault, without any training. Now look at the reward that
# we called good:

# %%
show(
    bar_chart(
        "What the 'good' reward pays",
        earnings(good_reward),
        subtitle="Reward in a second of driving",
        highlighted=["wrong way"],
    ),
    "good-pays",
)

# %% [markdown]
# Whoever drives the **wrong way** earns as much as anybody. Our cars did not find out, since they start facing
# forwards and an episode ends when a car goes back for a second. Yet the hole is there. Rewards have such holes more
# often than not, and good learners find them.

# %% [markdown]
# ## Your turn: five repairs
#
# Each cell holds a broken reward. Change it until the check says *Solved*. The checks let the seven drivers drive and
# look who earns what, so there are many right answers.
#
# What `params` knows, among other things: `speed` (m/s), `all_wheels_on_track`, `is_offtrack`, `distance_from_center`
# and `track_width` (m), `steering_angle` (degrees, left positive), `heading` (degrees), `progress` (percent),
# `waypoints` and `closest_waypoints`.
#
# **1.** It stays inside, and strolls.


# %% exercise inside
def reward_function(params):
    return 1.0 if params["all_wheels_on_track"] else 0.001


# %%
verdict = check("1.inside", reward_function)
print(verdict)

# %% [markdown]
# **2.** The middle of the road was meant to count, too.


# %% exercise overwritten
def reward_function(params):
    reward = 0.001
    if params["distance_from_center"] < 0.25 * params["track_width"]:
        reward = 1.0
    reward = params["speed"]
    return reward


# %%
verdict = check("1.overwritten", reward_function)
print(verdict)

# %% [markdown]
# **3.** A restless hand.


# %% exercise zigzag
def reward_function(params):
    return abs(params["steering_angle"]) / 30.0 if params["all_wheels_on_track"] else 0.001


# %%
verdict = check("1.zigzag", reward_function)
print(verdict)

# %% [markdown]
# **4.** It pays for being parallel to the road. A car that faces backwards is parallel, too.

# %% exercise backwards
import math


def reward_function(params):
    before, after = (params["waypoints"][index] for index in params["closest_waypoints"])
    road = math.atan2(after[1] - before[1], after[0] - before[0])
    angle = road - math.radians(params["heading"])
    return abs(math.cos(angle)) * params["speed"]


# %%
verdict = check("1.backwards", reward_function)
print(verdict)

# %% [markdown]
# **5.** All or nothing.


# %% exercise cliff
def reward_function(params):
    return 1.0 if params["speed"] >= 3.0 else 0.001


# %%
verdict = check("1.cliff", reward_function)
print(verdict)

# %% [markdown]
# ## Let it drive
#
# The last `reward_function` that you wrote (the one above, until you change it) now teaches a car of its own, which
# may choose up to 4 m/s.

# %%
yours = drive(teach(reward_function, "fast"))
show(drawn_lines("Your car", {"your reward": yours, "our good one": good_drives}, cars=6), "your-car")

# %% [markdown]
# ## What to take along
#
# - The **reward** is the only thing that the learner hears from us; it becomes what is paid, not what is meant.
# - Before training, ask **whom it likes best**: the slow one? the one who weaves? the one who goes back?
# - A reward should **grow a little** with every little improvement; a cliff teaches nothing.
#
# The same from camera pixels, on a real track, takes one command: `racecraft train --reward reward_function.py`. What
# the learner does with the rewards is what the next lessons are about. Answer the quiz with `racecraft lessons quiz
# 1`.
