"""Structure selection by likelihood: what enters the model, what leaves it, and what could stand instead."""
