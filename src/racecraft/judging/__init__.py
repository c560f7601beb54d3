"""Runs are judged: each job loads policies from run folders, holds an evaluation or a race, and leaves its files."""
