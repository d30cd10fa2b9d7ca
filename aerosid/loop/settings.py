"""Settings of the loop, all in one place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from aerosid.equation_error.settings import EquationErrorSettings
from aerosid.model_error.paper_chain.chain import ChainSettings
from aerosid.search.partial_correlation.settings import ModelErrorSearchSettings
from aerosid.search.settings import AttributionSettings

Method = Literal["evidence", "likelihood", "equations", "iebmee"]

METHODS: tuple[Method, ...] = ("evidence", "likelihood", "equations", "iebmee")
"""The first is the default."""

Progress = Callable[[str], None]
"""Called with the name of each stage as it begins."""


class StartValues(NamedTuple):
    """An estimate of the declared structure: `values` of its terms, noise `variance` of each output, SI squared."""

    values: tuple[float, ...]
    variance: tuple[float, ...]


@dataclass(frozen=True)
class LoopSettings:
    """Every setting of the chain, in one place.

    Attributes
    ----------
    chain : ChainSettings
        Prefilter, model-error estimator and recursive least squares.
    method : "evidence", "likelihood", "equations" or "iebmee"
        Method of structure determination: score tests of the simulated flight's likelihood, the kinematic and
        coefficient equations with coloured residuals, or the model error d(t) of Parameswaran & Raol 1994. With
        "evidence" the first where kinematics close at the sensors' noise, the second where they do not.
    model_error : ModelErrorSearchSettings
        Of method iebmee.
    attribution : AttributionSettings
        Criteria for a term to enter where the catalogue is of terms alone.
    equation_error : EquationErrorSettings
        Criteria of the kinematic and coefficient equations for an effect to enter.
    catalogue : "all" or "terms"
        Which kinds of effect are considered: all of them, or aerodynamic terms alone, for studies of many runs.
    paper_chain : bool
        Whether the model error d(t), its correlations and recursive least squares are computed too.
    second_opinion : bool
        Whether method iebmee is run as a cross-check where the likelihood decides.
    linear_analysis : bool
        Whether modes and flying qualities of the models are computed.
    kinematics : bool
        Whether the instruments are compared by kinematics first.
    priors : bool
        Whether the a-priori values of the aircraft file enter the estimate with their sigma; by default the flight
        data alone.
    seed : int
        Of every random draw; reported.
    flight_phase, aircraft_class : str or None
        Category and class for the levels of MIL-F-8785C; by default the aircraft file's, else B and II.
    next_flight : bool
        Whether an input is designed where a question is open.
    limits : mapping of str to (float, float)
        Of that input: alpha, n_z, V, theta, beta, phi, surfaces and their rates (delta_e_rate), SI; they win over those
        of the aircraft file.
    start : StartValues or None
        Where the re-estimation of the declared structure begins, for runs of a study that know it from another flight;
        None: at the declared values and the noise of the logs.
    samples_ahead : int
        Samples of all logs up to which the equations are begun beside a likelihood search that is unlikely to end with
        an adequate model; beyond, both would need their memory at once.
    """

    chain: ChainSettings = field(default_factory=ChainSettings)
    method: Method = "evidence"
    model_error: ModelErrorSearchSettings = field(default_factory=ModelErrorSearchSettings)
    attribution: AttributionSettings = field(default_factory=AttributionSettings)
    equation_error: EquationErrorSettings = field(default_factory=EquationErrorSettings)
    catalogue: Literal["all", "terms"] = "all"
    paper_chain: bool = True
    second_opinion: bool = True
    linear_analysis: bool = True
    kinematics: bool = True
    priors: bool = False
    seed: int = 0
    flight_phase: str | None = None
    aircraft_class: str | None = None
    next_flight: bool = True
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    start: StartValues | None = None
    samples_ahead: int = 20_000


USUAL = LoopSettings()
"""The default settings of a loop."""
