"""Follow the centre line: the closer, the better. This is the platform's default reward."""


def reward_function(params):
    track_width = params["track_width"]
    distance_from_center = params["distance_from_center"]

    # Three bands around the centre line, as fractions of the road's full width.
    if distance_from_center <= 0.10 * track_width:
        return 1.0
    if distance_from_center <= 0.25 * track_width:
        return 0.5
    if distance_from_center <= 0.50 * track_width:
        return 0.1

    # Beyond the border the car has probably crashed, or is about to.
    return 1e-3
