"""Work for child processes: the queue, who starts them, and what they do."""
