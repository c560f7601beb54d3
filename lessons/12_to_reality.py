# %% [markdown]
# # Lesson 12 · From simulation to reality, and a race
#
# **Goal.** You can say why a driver that is perfect in one world fails in the next, what to draw by lot against it, and
# judge drivers on tracks that none of them has seen.
#
# A simulator is never right. Its tyres are a little better than yours, its lamps brighter, its camera sits half a
# degree steeper. A driver that learns in *one* world learns its mistakes by heart. The remedy is a strange one: make
# the simulator wrong in **many ways**, by lot, so that reality is only one more way. That is called *domain
# randomisation* (Tobin and others, 2017).

# %%
import tempfile


from racecraft import Simulation, load_track, load_tracks, train
from racecraft.course import check, show
from racecraft.course.pictures import bar_chart, image_rows
from racecraft.race.generalization import generalize
from racecraft.race.policy import load_driver

worlds = {}
for name in ("none", "light", "strong"):
    cars = Simulation(load_track("reinvent_2018"), num_envs=5, randomize=name, seed=4, num_threads=1)
    cars.reset()
    worlds[name] = [frame.copy() for frame in cars.frames]
show(
    image_rows(
        "One place in eleven worlds", worlds, subtitle="What a car sees at the start, by how much is drawn by lot"
    ),
    "worlds",
)

# %% [markdown]
# And that is only what one sees. Tyres, weight, speed, a bias of the steering and a delay differ, too.
#
# ## Three drivers, an hour before the race
#
# They learn for as long, 30,000 pictures each, with the same reward and the same network:
#
# - **one track**: on the oval, always in the same world,
# - **many tracks**: on our own tracks and on sixteen from the generator, both ways,
# - **many worlds**: the same, and everything drawn by lot.

# %%
MANY = ["library", "generated:0..15,radius=0.45,difficulty=0.9"]
SCHOOLS = {
    "one track": {"track": "oval"},
    "many tracks": {"track": MANY, "direction": "alternate"},
    "many worlds": {"track": MANY, "direction": "alternate", "randomize": "strong"},
}
drivers = {}
for name, school in SCHOOLS.items():
    trained = train(**school, reward="centerline", actions="safe", until="30000 steps", seed=1, root=tempfile.mkdtemp())
    drivers[name] = load_driver(trained.run, checkpoint="last")

# %% [markdown]
# ## The race
#
# Six tracks that nobody has seen, both ways, a lap on each: first in the world that everybody knows, and then in
# worlds drawn by lot, which stand for reality.

# %%
UNSEEN = load_tracks("generated:100..105")
results = {
    world: {
        name: generalize(driver, UNSEEN, randomize=world, seed=1, num_threads=1) for name, driver in drivers.items()
    }
    for world in ("none", "strong")
}
show(
    bar_chart(
        "Tracks that nobody has seen",
        {
            f"{name}, {'as always' if world == 'none' else 'by lot'}": float(found.laps)
            for name in drivers
            for world, found in ((world, results[world][name]) for world in results)
        },
        subtitle="Laps of 12, in the world of the training and in worlds by lot",
        digits=0,
    ),
    "unseen",
)

# %% [markdown]
# In the world that they know nearly everybody gets round: 12, 10 and 12 of 12 laps with three seeds for one track, and
# 12 each for the others. In worlds by lot, seeds 1, 2 and 3:
#
# | | laps of 12 |
# |---|---|
# | one track | 10, 7, 6 |
# | many tracks | 10, 12, 7 |
# | many worlds | 11, 12, 12 |
#
# **Whoever has met worlds of all kinds gets round in a new one.** It is no magic, though: with twice the steps many
# tracks alone came close, 16, 18 and 16 of 20 laps against 17, 18 and 17. Many roads teach a good deal of it.

# %% [markdown]
# ## The ladder of the class
#
# Who is best? On every track whoever laps fastest gets 3 points, the next 2, then 1; who does not get round gets
# none. With runs of your own, `racecraft ladder runs/a runs/b runs/c` does it properly, with all against all and an
# error of each rating.

# %%
points = dict.fromkeys(drivers, 0.0)
for course in range(len(UNSEEN) * 2):
    times = {
        name: found.results[course].lap_times[0]
        for name, found in results["strong"].items()
        if found.results[course].laps
    }
    for place, name in enumerate(sorted(times, key=lambda one: times[one])):
        points[name] += 3.0 - place
show(
    bar_chart(
        "The ladder",
        dict(sorted(points.items(), key=lambda item: -item[1])),
        subtitle="Points on six unseen tracks, both ways, in worlds drawn by lot",
        digits=0,
    ),
    "ladder",
)

# %% [markdown]
# Twelve laps are not many. A driver that completes 9 of 12 may be one that completes half of all laps or nearly all
# of them. Whoever wants to know drives a hundred, and says how sure the figure is:

# %%
for name, found in results["strong"].items():
    low, high = found.lap_interval.low, found.lap_interval.high
    print(
        f"{name:12} {found.laps} of {found.trials} laps: between {100 * low:.0f} and {100 * high:.0f} of "
        "100, with 95 % confidence"
    )

# %% [markdown]
# ## Your turn: what to draw by lot
#
# Five cars of a class were measured. Choose ranges to train in: lowest and highest of each.
#
# | | car 1 | 2 | 3 | 4 | 5 |
# |---|---|---|---|---|---|
# | friction (factor) | 0.71 | 0.95 | 0.83 | 1.08 | 0.77 |
# | light (factor) | 0.62 | 1.35 | 0.9 | 1.1 | 0.75 |
# | latency (steps) | 0.1 | 0.6 | 0.4 | 0.2 | 0.9 |
# | steering bias (rad) | -0.03 | 0.02 | 0.04 | -0.01 | 0.0 |

# %% exercise ranges
ranges = {
    "friction": (1.0, 1.0),
    "light": (1.0, 1.0),
    "latency": (0.0, 0.0),
    "steering_bias": (0.0, 0.0),
}

# %%
verdict = check("12.ranges", ranges)
print(verdict)

# %% [markdown]
# ## What to take along
#
# - A driver learns what *all* its worlds have in common. With one world that is everything, its mistakes included.
# - **Many roads** teach to read a road; **many worlds** teach not to rely on light and tyres. Measure which of them you
#   lack.
# - Judge on what nobody has **seen**, drive often, and say how sure you are.
#
# That is the course: from "what is a reward" to a driver that learned from pixels and races on unseen tracks. Now make
# your own: `racecraft train`, and the final is open. Answer the last quiz: `racecraft lessons quiz 12`.
