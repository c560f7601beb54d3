"""Reward functions: AWS's ``reward_function(params)``, checked before it runs, and run in its own process."""
