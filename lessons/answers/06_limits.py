# %% right cell
def cell(numbers, low, high, bins):
    total = 0
    for value, bottom, top in zip(numbers, low, high, strict=True):
        index = int((value - bottom) / (top - bottom) * bins)
        total = total * bins + max(0, min(index, bins - 1))
    return total


# %% wrong cell: a sum mixes cells up
def cell(numbers, low, high, bins):
    return sum(int((value - a) / (b - a) * bins) for value, a, b in zip(numbers, low, high, strict=True))


# %% wrong cell: the upper bound falls out of the table
def cell(numbers, low, high, bins):
    total = 0
    for value, bottom, top in zip(numbers, low, high, strict=True):
        total = total * bins + int((value - bottom) / (top - bottom) * bins)
    return total


# %% wrong cell: low is forgotten
def cell(numbers, low, high, bins):
    total = 0
    for value, bottom, top in zip(numbers, low, high, strict=True):
        total = total * bins + int(value / (top - bottom) * bins)
    return total


# %% wrong cell: for two numbers only
def cell(numbers, low, high, bins):
    first, second = (
        max(0, min(int((value - a) / (b - a) * bins), bins - 1))
        for value, a, b in list(zip(numbers, low, high, strict=True))[:2]
    )
    return first * bins + second


# %% wrong cell: no whole number
def cell(numbers, low, high, bins):
    return float(sum(numbers))
