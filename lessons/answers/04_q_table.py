# %% right bellman
def backup(outcomes, worth, gamma):
    best = []
    for action in outcomes:
        total = 0.0
        for probability, after, reward, is_over in outcomes[action]:
            total += probability * (reward + gamma * worth[after] * (not is_over))
        best.append(total)
    return max(best)


# %% wrong bellman: the reward now, and nothing of what comes
def backup(outcomes, worth, gamma):
    return max(sum(p * reward for p, _, reward, _ in outcomes[action]) for action in outcomes)


# %% wrong bellman: the mean over the actions, as if chosen by lot
def backup(outcomes, worth, gamma):
    total = 0.0
    for action in outcomes:
        for probability, after, reward, is_over in outcomes[action]:
            total += probability * (reward + gamma * worth[after] * (not is_over)) / len(outcomes)
    return total


# %% wrong bellman: every outcome as if it were certain
def backup(outcomes, worth, gamma):
    return max(reward + gamma * worth[after] for action in outcomes for _, after, reward, _ in outcomes[action])


# %% wrong bellman: probabilities left out of a sum
def backup(outcomes, worth, gamma):
    return max(sum(r + gamma * worth[s] for _, s, r, _ in outcomes[action]) for action in outcomes)


# %% right update
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor].max()
    values[state, action] += alpha * (reward + gamma * future - values[state, action])


# %% wrong update: the whole way at once
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor].max()
    values[state, action] = reward + gamma * future


# %% wrong update: there is something after the end
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    surprise = reward + gamma * values[successor].max() - values[state, action]
    values[state, action] += alpha * surprise


# %% wrong update: gamma is forgotten
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor].max()
    values[state, action] += alpha * (reward + future - values[state, action])


# %% wrong update: nothing is taken off
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor].max()
    values[state, action] += alpha * (reward + gamma * future)


# %% wrong update: a copy was changed
def update(values, state, action, reward, successor, terminated, alpha, gamma):
    values = values.copy()
    values[state, action] += alpha * (reward + gamma * values[successor].max() - values[state, action])


# %% right sarsa
def update(values, state, action, reward, successor, next_action, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor, next_action]
    values[state, action] += alpha * (reward + gamma * future - values[state, action])


# %% wrong sarsa: that is Q-learning
def update(values, state, action, reward, successor, next_action, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor].max()
    values[state, action] += alpha * (reward + gamma * future - values[state, action])


# %% wrong sarsa: the end is forgotten
def update(values, state, action, reward, successor, next_action, terminated, alpha, gamma):
    values[state, action] += alpha * (reward + gamma * values[successor, next_action] - values[state, action])


# %% wrong sarsa: the whole row moves
def update(values, state, action, reward, successor, next_action, terminated, alpha, gamma):
    future = 0.0 if terminated else values[successor, next_action]
    values[state] += alpha * (reward + gamma * future - values[state])
