# %% right cuts
cuts = {"offset": (-0.2, 0.2), "sin_heading_error": (-0.2, -0.07, 0.07, 0.2), "curvature_2": (0.3,)}

# %% wrong cuts: blind to where it is across the road
cuts = {"offset": (), "sin_heading_error": (-0.2, -0.07, 0.07, 0.2), "curvature_2": (0.3,)}

# %% wrong cuts: finer is not allowed
cuts = {
    "offset": (-0.6, -0.3, -0.1, 0.1, 0.3, 0.6),
    "sin_heading_error": (-0.4, -0.2, -0.07, 0.07, 0.2, 0.4),
    "curvature_2": (-0.3, 0.3),
}

# %% wrong cuts: cut where the car never is
cuts = {"offset": (-4.0, -3.0, 3.0, 4.0), "sin_heading_error": (-0.9, 0.9), "curvature_2": (0.3,)}

# %% wrong cuts: from high to low
cuts = {"offset": (0.2, -0.2), "sin_heading_error": (-0.1, 0.1), "curvature_2": (0.3,)}
