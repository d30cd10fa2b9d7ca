"""What enters the model, what leaves it, and what could stand instead."""
