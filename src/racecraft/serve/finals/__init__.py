"""Finals in which two meet at a time: who drives, the job that drives their duels, what there is to see of them."""
