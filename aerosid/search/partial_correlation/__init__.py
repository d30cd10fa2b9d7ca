"""Stepwise selection of terms by partial correlation with the model error d(t)."""
