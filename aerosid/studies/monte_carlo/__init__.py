"""Monte Carlo of the whole chain: detection, efficiency against the Cramer-Rao bound, coverage of the intervals.

`plan` defines flights and search, `truth` simulates them without noise, `trial` draws the noise and runs the chain
once, `statistics` combines the runs; `run` distributes them to workers and continues an interrupted study.
"""

from aerosid.studies.monte_carlo.plan import FlownInput, StudyPlan
from aerosid.studies.monte_carlo.planted import Planted, parse_planted
from aerosid.studies.monte_carlo.run import Study, run_study
from aerosid.studies.monte_carlo.statistics import LevelStatistics
from aerosid.studies.monte_carlo.writing import write_study

__all__ = [
    "FlownInput",
    "LevelStatistics",
    "Planted",
    "Study",
    "StudyPlan",
    "parse_planted",
    "run_study",
    "write_study",
]
