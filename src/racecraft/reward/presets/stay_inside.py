"""Stay inside the borders: any line will do, as long as all wheels are on the road with room to spare."""

MARGIN = 0.05  # metres that must be left between the car's middle and the border


def reward_function(params):
    distance_to_border = 0.5 * params["track_width"] - params["distance_from_center"]

    if params["all_wheels_on_track"] and distance_to_border >= MARGIN:
        return 1.0
    return 1e-3
