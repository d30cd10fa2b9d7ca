"""Structure selection in the regression: hypotheses, penalties, stepwise selection, cross-validation, alternatives."""
