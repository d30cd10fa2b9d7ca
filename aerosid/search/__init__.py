"""Structure search: what the declared model lacks, and what could stand in its place."""
