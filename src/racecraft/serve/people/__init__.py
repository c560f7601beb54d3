"""Who there is: accounts, passwords, sessions, cards, tokens."""
