import math
import json

def reward_function(params):
    DEBUG = True
    if DEBUG:
        print("params: ", {k: v for k, v in params.items() if k != "waypoints"})
    reward = params["speed"] ** 2 if params["all_wheels_on_track"] else 1e-3
    print("STEP: {:d} REWARD: {:.3f}".format(int(params['steps']), reward))
    print(f"progress={params['progress']:.1f}% of {params['track_length']:.2f} m", end="\r\n", flush=True)
    print(json.dumps({"x": round(params["x"], 3), "y": round(params["y"], 3)}))
    print("%s %d %5.2f%%" % (params['is_reversed'], params['closest_waypoints'][0], params['progress']))
    print()
    return reward
