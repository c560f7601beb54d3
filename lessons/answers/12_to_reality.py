# %% right ranges
ranges = {"friction": (0.65, 1.15), "light": (0.5, 1.5), "latency": (0.0, 1.0), "steering_bias": (-0.05, 0.05)}

# %% wrong ranges: the mean of all
ranges = {"friction": (0.87, 0.87), "light": (0.94, 0.94), "latency": (0.44, 0.44), "steering_bias": (0.0, 0.0)}

# %% wrong ranges: one car is left out
ranges = {"friction": (0.75, 1.15), "light": (0.5, 1.5), "latency": (0.0, 1.0), "steering_bias": (-0.05, 0.05)}

# %% wrong ranges: ready for everything
ranges = {"friction": (0.1, 2.0), "light": (0.1, 3.0), "latency": (0.0, 2.0), "steering_bias": (-0.3, 0.3)}

# %% wrong ranges: something is missing
ranges = {"friction": (0.65, 1.15), "light": (0.5, 1.5)}
