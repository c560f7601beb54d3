"""The garage: models, their archives, their copies in a store."""
