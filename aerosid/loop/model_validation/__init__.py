"""Model validation: prediction errors in open loop and ahead, goodness of fit, each effect left out."""
