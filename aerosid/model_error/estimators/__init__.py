"""The estimators of d(t) for any model given as functions: discrete, continuous, fixed-interval and streaming."""
