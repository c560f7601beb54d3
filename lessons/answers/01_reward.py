# %% right inside
def reward_function(params):
    return params["speed"] if params["all_wheels_on_track"] else 0.001


# %% wrong inside: one more constant changes nothing
def reward_function(params):
    return 10.0 if params["all_wheels_on_track"] else -10.0


# %% wrong inside: speed alone, and the border is forgotten
def reward_function(params):
    return params["speed"]


# %% wrong inside: who drives must pay
def reward_function(params):
    return params["speed"] - 5.0 if params["all_wheels_on_track"] else -10.0


# %% right overwritten
def reward_function(params):
    reward = 0.1
    if params["distance_from_center"] < 0.25 * params["track_width"]:
        reward = 1.0
    reward *= params["speed"]
    return reward


# %% wrong overwritten: the lines changed places, and now speed is overwritten
def reward_function(params):
    reward = params["speed"]
    if params["distance_from_center"] < 0.25 * params["track_width"]:
        reward = 1.0
    else:
        reward = 0.001
    return reward


# %% wrong overwritten: the speed is still all that counts
def reward_function(params):
    reward = 0.001
    if params["distance_from_center"] < 0.25 * params["track_width"]:
        reward += 1.0
    reward = 2.0 * params["speed"]
    return reward


# %% wrong overwritten: a misspelt name
def reward_function(params):
    return params["speed"] * (1.0 - params["distance_from_centre"])


# %% right zigzag
def reward_function(params):
    calm = 1.0 - abs(params["steering_angle"]) / 30.0
    return params["speed"] * (0.3 + calm) if params["all_wheels_on_track"] else 0.001


# %% wrong zigzag: half as much for the same
def reward_function(params):
    return 0.5 * abs(params["steering_angle"]) / 30.0 if params["all_wheels_on_track"] else 0.001


# %% wrong zigzag: a constant neither likes nor dislikes weaving
def reward_function(params):
    return 1.0


# %% wrong zigzag: calm, and in no hurry
def reward_function(params):
    return 1.0 - abs(params["steering_angle"]) / 30.0 if params["all_wheels_on_track"] else 0.001


# %% right backwards
import math


def reward_function(params):
    before, after = (params["waypoints"][index] for index in params["closest_waypoints"])
    road = math.atan2(after[1] - before[1], after[0] - before[0])
    angle = road - math.radians(params["heading"])
    return math.cos(angle) * params["speed"]


# %% wrong backwards: squared is as blind as abs
import math


def reward_function(params):
    before, after = (params["waypoints"][index] for index in params["closest_waypoints"])
    road = math.atan2(after[1] - before[1], after[0] - before[0])
    return math.cos(road - math.radians(params["heading"])) ** 2 * params["speed"]


# %% wrong backwards: less is still something
import math


def reward_function(params):
    before, after = (params["waypoints"][index] for index in params["closest_waypoints"])
    road = math.atan2(after[1] - before[1], after[0] - before[0])
    return (2.0 + math.cos(road - math.radians(params["heading"]))) * params["speed"]


# %% wrong backwards: the sign is turned round
import math


def reward_function(params):
    before, after = (params["waypoints"][index] for index in params["closest_waypoints"])
    road = math.atan2(after[1] - before[1], after[0] - before[0])
    return -1.0 - abs(math.sin(road - math.radians(params["heading"]))) * params["speed"]


# %% right cliff
def reward_function(params):
    return params["speed"] if params["all_wheels_on_track"] else -1.0


# %% wrong cliff: it has moved
def reward_function(params):
    return 1.0 if params["speed"] >= 1.2 else 0.001


# %% wrong cliff: higher, and still out of reach
def reward_function(params):
    return 100.0 if params["speed"] >= 3.0 else 0.001


# %% wrong cliff: a slope into the grass
def reward_function(params):
    return params["speed"] ** 2
