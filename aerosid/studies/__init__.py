"""Studies of many flights: Monte Carlo, batches of logs, JSBSim, the paper reproduced, Cramer-Rao bounds."""
