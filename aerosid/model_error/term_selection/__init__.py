"""Selection of missing terms by partial correlation with the model error in coloured noise, on plain arrays."""
