"""Selection of structure in the regression: hypotheses, their price, entry and exchange, votes and alternatives."""
