"""How fast the estimator and the whole loop are, and how both grow: `make benchmark`."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does, and before numpy is imported
