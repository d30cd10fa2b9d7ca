"""Structure determination by likelihood: stepwise selection, acceptance tests, indistinguishable alternatives."""
