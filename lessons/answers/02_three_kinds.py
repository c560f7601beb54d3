# %% right odd: farthest from the mean
def odd_one(images):
    return int(((images - images.mean(axis=0)) ** 2).sum(axis=(1, 2)).argmax())


# %% wrong odd: never looks
def odd_one(images):
    return 0


# %% wrong odd: the most ordinary one
def odd_one(images):
    return int(((images - images.mean(axis=0)) ** 2).sum(axis=(1, 2)).argmin())


# %% wrong odd: the distance instead of the place
def odd_one(images):
    return ((images - images.mean(axis=0)) ** 2).sum(axis=(1, 2)).max()


# %% wrong odd: one pixel for all
def odd_one(images):
    return int(images[:, 0, 0].argmax())
