"""The loop on recordings of real aircraft, against what others published of the same flights; skipped where absent."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recordings import recording

from aerosid.aircraft import load_aircraft
from aerosid.aircraft.bundled import bundled_folder
from aerosid.compatibility import InstrumentFinding, check_kinematics
from aerosid.compatibility.contradiction import contradictions
from aerosid.compatibility.recording import read_recording
from aerosid.logs.flight_log import FlightLog
from aerosid.logs.formats import read_log
from aerosid.loop.closed_loop import close_loop
from aerosid.loop.derivative_table import DerivativeRow
from aerosid.loop.result import ClosedLoop
from aerosid.loop.settings import LoopSettings
from aerosid.loop.verdict import Verdict

pytestmark = pytest.mark.slow

BY_LIKELIHOOD = LoopSettings(method="likelihood")


def read(name: str, channel_map: str) -> FlightLog:
    return read_log(Path(recording(name)), bundled_folder("flight_data") / "channel_maps" / channel_map)


def derivative(result: ClosedLoop, coefficient: str, term: str) -> float:
    return next(row.value for row in result.derivatives if (row.coefficient, row.term) == (coefficient, term))


def test_the_twin_otter_has_the_published_derivatives_and_a_late_vane() -> None:
    # NASA's equation-error estimates of the same flight, and its known delay of alpha of 0.025 s.
    result = close_loop(
        [read("twin_otter/totter_demo_018.csv", "twin_otter.toml")],
        load_aircraft("twin_otter"),
        [read("twin_otter/totter_lon_020213f1_017.csv", "twin_otter.toml")],
        settings=BY_LIKELIHOOD,
    )
    assert derivative(result, "C_m", "alpha") == pytest.approx(-1.48, rel=0.05)
    assert derivative(result, "C_m", "delta_e") == pytest.approx(-1.87, rel=0.05)
    assert -38.0 < derivative(result, "C_m", "q_hat") < -30.0
    q = next(row for row in result.errors if (row.role, row.channel) == ("validation", "q"))
    assert q.r2_trimmed is not None
    assert q.r2_trimmed > 0.99
    late = [effect.value for effect in result.effects if effect.kind in ("sensor_lag", "sensor_delay")]
    assert late
    assert all(0.015 < value < 0.035 for value in late)
    # Stepwise regression finds alpha^2 in C_X, and explains 85.0 and 88.7 % of it on the other flight without and with.
    drag = next(effect for effect in result.effects if (effect.where, effect.term) == ("C_X", "alpha^2"))
    assert drag.value == pytest.approx(5.0, abs=2.0 * drag.std_error)
    force = next(row for row in result.coefficients if (row.coefficient, row.log) == ("C_X", "totter_lon_020213f1_017"))
    assert force.r2_after > force.r2_before + 0.03
    assert result.verdict is Verdict.PARTLY_EXPLAINED


def of_the_twin_otter() -> ClosedLoop:
    return close_loop(
        [read("twin_otter/totter_demo_018.csv", "twin_otter.toml")],
        load_aircraft("twin_otter"),
        [read("twin_otter/totter_lon_020213f1_017.csv", "twin_otter.toml")],
    )


def test_by_default_the_twin_otter_has_a_late_vane_a_pitot_tube_below_and_a_bent_drag() -> None:
    result = of_the_twin_otter()
    first = result.effects[0]
    assert (first.kind, first.where) in {("sensor_lag", "alpha"), ("sensor_delay", "alpha")}
    assert first.value == pytest.approx(0.025, abs=0.005)
    arms = {(row.kind, row.where): row.value for row in result.alternatives}
    assert arms["sensor_position", "alpha"] == pytest.approx(1.65, abs=0.2)
    drag = next(effect for effect in result.effects if (effect.where, effect.term) == ("C_X", "alpha^2"))
    assert drag.value == pytest.approx(5.1, abs=2.0 * drag.std_error)
    # As an accelerometer above the centre of gravity it would need C_X delta_e and C_X q_hat that undo it.
    tube = next(effect for effect in result.effects if effect.kind == "sensor_position")
    assert tube.where == "V"
    assert "delta_e" not in {effect.term for effect in result.effects if effect.where == "C_X"}
    shares = {row.coefficient: row for row in result.coefficients if row.log == "totter_lon_020213f1_017"}
    assert shares["C_X"].r2_after > shares["C_X"].r2_before
    assert shares["C_Z"].r2_after > shares["C_Z"].r2_before
    assert shares["C_m"].r2_after > shares["C_m"].r2_before
    # In calm air: with a response to gusts of the opposite sign damping was -30.6 and C_m of the other flight .9949.
    assert -38.0 < derivative(result, "C_m", "q_hat") < -32.0
    assert shares["C_m"].r2_after > 0.996


def test_a_declared_derivative_that_a_named_term_contradicts_does_not_spoil_the_flight_it_is_completed_on() -> None:
    """C_X alpha is not shown beside alpha^2; the declared one with the flight's alpha^2 made a_x worse than before."""
    (row,) = [row for row in of_the_twin_otter().errors if (row.role, row.channel) == ("identification", "a_x")]
    assert row.before is not None
    assert row.after is not None
    assert row.after < 0.8 * row.before


def test_by_default_the_twin_otter_s_drag_is_predicted() -> None:
    result = of_the_twin_otter()
    shares = {row.coefficient: row for row in result.coefficients if row.log == "totter_lon_020213f1_017"}
    assert shares["C_X"].r2_after > 0.92


def without(log: FlightLog, channels: tuple[str, ...]) -> FlightLog:
    """The log as a map that leaves some channels out would read it."""
    return replace(log, channels={name: values for name, values in log.channels.items() if name not in channels})


def part(log: FlightLog, first: float, last: float) -> FlightLog:
    """Shares of a recording, its clock as it is."""
    rows = slice(int(first * log.time.size), int(last * log.time.size))
    return replace(
        log,
        name=f"{log.name} from {first:.2f}",
        time=log.time[rows],
        channels={name: values[rows] for name, values in log.channels.items()},
    )


def test_by_default_the_attas_has_a_biased_gyro_and_a_bent_drag() -> None:
    log = read("attas/fAttasElv1.mat", "attas_mat.toml")
    result = close_loop([part(log, 0.0, 2.0 / 3.0)], load_aircraft("attas"), [part(log, 2.0 / 3.0, 1.0)])
    found = {(effect.kind, effect.where, effect.term): effect for effect in result.effects}
    # A bias of q of .0033 rad/s; C_X alpha^2 of 3.4 to 3.8, which is the file's lift slope less this one.
    assert found["sensor_bias", "q", ""].value == pytest.approx(0.0033, abs=0.0002)
    # Attitude and its rate do not agree in size; which of them is wrong no kinematics tell.
    scales = {
        effect.where: effect.value
        for effect in (*result.effects, *result.alternatives)
        if effect.kind == "sensor_scale"
    }
    assert scales["q"] == pytest.approx(1.025, abs=0.01)
    assert scales["theta"] == pytest.approx(1.0 / scales["q"], abs=0.005)
    drag = found["aero_term", "C_D", "alpha^2"]
    assert derivative(result, "C_L", "alpha") - drag.value == pytest.approx(3.6, abs=0.4)
    # The last third holds next to no motion: a tenth of C_m is explained there by any model. Nothing may be predicted
    # worse; the difference of its squares has a deviation of .0077 of R^2 by the residuals' own correlation.
    unseen = {row.coefficient: row for row in result.coefficients if "0.67" in row.log}
    for coefficient, least in {"C_X": 0.005, "C_Z": 0.005, "C_m": 2.0 * 0.0077}.items():
        assert unseen[coefficient].r2_after > unseen[coefficient].r2_before - least


def test_what_kinematics_hardly_show_is_not_named_where_it_spoils_the_unseen_half() -> None:
    """V late by .36 s, 1 in ln L beyond its penalty: R^2 of C_X of the other half fell from .992 to .974 by it."""
    log = read("attas/fAttasElv1.mat", "attas_mat.toml")
    result = close_loop([part(log, 0.5, 1.0)], load_aircraft("attas"), [part(log, 0.0, 0.5)])
    assert "V" not in {effect.where for effect in result.effects}
    assert any("sensor_delay of V" in note for note in result.notes if note.startswith("Near-significant"))
    for row in result.coefficients:
        assert row.r2_after > row.r2_before - 0.005


def test_a_centre_of_gravity_half_a_chord_away_gives_way_to_the_lift_of_the_elevator() -> None:
    """Without its prior the shift of 1.5 m is 37 in ln L more likely than that derivative, and with it 10 less."""
    result = close_loop([read("attas/fAttasElv1.mat", "attas_mat.toml")], load_aircraft("attas"))
    found = {(effect.kind, effect.where, effect.term): effect for effect in result.effects}
    assert found["aero_term", "C_L", "delta_e"].value == pytest.approx(0.3, abs=0.1)
    assert found["aero_term", "C_D", "alpha^2"].value == pytest.approx(1.67, abs=0.5)
    assert not any(kind == "cg_shift" for kind, _, _ in found)


def test_by_default_the_attas_stalls_with_its_stabiliser_and_thrust_in_the_moment() -> None:
    result = close_loop([read("attas/fAttas_qst01_withHeader.asc", "attas_stall.toml")], load_aircraft("attas"))
    found = {(effect.kind, effect.where, effect.term): effect for effect in result.effects}
    separation = next(effect for key, effect in found.items() if key[0] == "flow_separation")
    # Published: .309 rad, with thrust and stabiliser left out.
    assert separation.value == pytest.approx(0.29, abs=0.03)
    assert found["aero_term", "C_m", "delta_h"].value == pytest.approx(-2.3, abs=0.4)
    assert found["aero_term", "C_m", "C_T"].value == pytest.approx(0.35, abs=0.1)
    moment = next(row for row in result.coefficients if row.coefficient == "C_m")
    assert moment.r2_after > 0.9 > 0.0 > moment.r2_before


@pytest.mark.parametrize("missing", [(), ("h",), ("theta",), ("h", "theta")])
def test_by_default_the_citation_s_vane_is_named_first_whatever_else_was_recorded(missing: tuple[str, ...]) -> None:
    log = without(read("citation/seg_ref_20180312_shortperiod.csv", "citation.toml"), missing)
    result = close_loop([part(log, 0.0, 0.6)], load_aircraft("citation"), [part(log, 0.6, 1.0)])
    first = result.effects[0]
    assert (first.kind, first.where) in {("sensor_lag", "alpha"), ("sensor_delay", "alpha")}
    assert 0.15 < first.value < 0.27
    unseen = [row for row in result.coefficients if "0.60" in row.log]
    assert len(unseen) == 3
    # Without height C_Z, explained to .996 by the declared model already, loses two ten-thousandths.
    slack = 5e-4 if missing == ("h",) else 0.0
    assert all(row.r2_after > row.r2_before - slack for row in unseen)
    assert all(row.r2_after > 0.9 for row in unseen)


def test_no_number_that_a_declared_value_contradicts_is_left_within_three_deviations_of_none() -> None:
    """On this stretch C_Z q_hat at its declared value took C_Z V_hat from four of its deviations to 2.6."""
    log = read("citation/seg_ref_20180312_shortperiod.csv", "citation.toml")
    fitted, unseen = log.between(3625.0, 3649.0), log.between(3649.0, 3665.0)
    result = close_loop([fitted], load_aircraft("citation"), [unseen])
    named = [effect for effect in result.effects if effect.std_error and effect.kind != "sensor_scale"]
    assert len(named) > 5
    assert all(abs(effect.value) >= 3.0 * effect.std_error for effect in named if effect.std_error)


@pytest.mark.parametrize("missing", [(), ("h",), ("theta",)])
def test_the_whole_citation_has_a_late_vane_and_not_three_early_sensors(missing: tuple[str, ...]) -> None:
    log = without(read("citation/seg_ref_20180312_shortperiod.csv", "citation.toml"), missing)
    result = close_loop([log], load_aircraft("citation"))
    first = result.effects[0]
    assert (first.kind, first.where) in {("sensor_lag", "alpha"), ("sensor_delay", "alpha")}
    assert 0.12 < first.value < 0.27
    assert not [effect for effect in result.effects if effect.kind == "sensor_delay" and effect.value < -0.05]


def test_what_the_instruments_doubt_makes_room_for_what_it_stood_for() -> None:
    """Near the stall, terms of C_X that the vane's bias could have made left, and nothing was asked in their place."""
    whole = read("citation/phlab_ref_20180312_full_10Hz.csv.gz", "citation.toml")
    near_stall, short_period = whole.between(1930.0, 2010.0), whole.between(3625.0, 3670.0)
    result = close_loop([near_stall], load_aircraft("citation"), [short_period])
    others = {log.name for log in result.validation}
    unseen = {row.coefficient: row for row in result.coefficients if row.log in others}
    assert set(unseen) == {"C_X", "C_Z", "C_m"}
    for row in unseen.values():
        assert row.r2_after > row.r2_before + 0.2
    assert unseen["C_Z"].r2_after > 0.98


CITATION_MANOEUVRES = {
    "approach to the stall": (1932.0, 2005.0),
    "pull-up": (2916.0, 2990.0),
    "phugoid pulse": (3225.0, 3265.0),
    "parabola": (4172.0, 4208.0),
}
"""s of the whole flight."""


def manoeuvres_of_the_citation(fitted: str, unseen: str) -> ClosedLoop:
    whole = read("citation/phlab_ref_20180312_full_10Hz.csv.gz", "citation.toml")
    one, other = (whole.between(*CITATION_MANOEUVRES[name]) for name in (fitted, unseen))
    return close_loop([one], load_aircraft("citation"), [other])


def test_a_drag_polar_is_no_separation_at_an_angle_that_was_not_flown() -> None:
    """Separation ended at its limit, .36 rad, without a standard error; C_X of the pull-up fell from .93 to .86."""
    result = manoeuvres_of_the_citation("parabola", "pull-up")
    assert not any(effect.kind == "flow_separation" for effect in result.effects)
    assert any(effect.where == "C_X" and "alpha^" in effect.term for effect in result.effects)
    (axial,) = (row for row in result.coefficients if row.coefficient == "C_X" and row.log == result.validation[0].name)
    assert axial.r2_after > 0.97 > axial.r2_before


@pytest.mark.parametrize(
    ("fitted", "unseen"), [("pull-up", "phugoid pulse"), ("approach to the stall", "pull-up"), ("parabola", "pull-up")]
)
def test_every_name_of_a_manoeuvre_is_three_of_its_deviations_from_none(fitted: str, unseen: str) -> None:
    """Turbulence of .43 +- .21 m/s, and a step of C_Z of -.089 +- .032 by its instant's deviations."""
    result = manoeuvres_of_the_citation(fitted, unseen)
    assert result.effects
    for effect in result.effects:
        none = 1.0 if effect.kind == "sensor_scale" else 0.0
        assert effect.std_error > 0.0
        assert abs(effect.value - none) >= 3.0 * effect.std_error


def test_terms_that_fit_whitened_residuals_and_not_their_coefficient_are_not_named() -> None:
    """Three terms of q_hat in C_X, whose drift is that of an unrecorded thrust: R^2 of the fitted stretch was -3.4."""
    whole = read("citation/phlab_ref_20180312_full_10Hz.csv.gz", "citation.toml")
    result = close_loop([whole.between(3689.0, 3749.0)], load_aircraft("citation"), [whole.between(3749.0, 3799.0)])
    assert not [effect for effect in result.effects if (effect.kind, effect.where) == ("aero_term", "C_X")]
    axial = [row for row in result.coefficients if row.coefficient == "C_X"]
    assert len(axial) == 2
    assert all(row.r2_after > row.r2_before - 0.5 for row in axial)


@pytest.mark.parametrize("start", [2969.0, 3689.0])
def test_a_delay_that_all_coefficients_refute_is_not_named(start: float) -> None:
    """By kinematics a_z early by .42 s and alpha late by .38 s; with these C_Z of the unseen stretch was lowered."""
    whole = read("citation/phlab_ref_20180312_full_10Hz.csv.gz", "citation.toml")
    fitted, unseen = whole.between(start, start + 60.0), whole.between(start + 60.0, start + 110.0)
    result = close_loop([fitted], load_aircraft("citation"), [unseen])
    (other,) = (log.name for log in result.validation)
    assert all(abs(effect.value) < 0.3 for effect in result.effects if effect.kind in ("sensor_delay", "sensor_lag"))
    (lift,) = (row for row in result.coefficients if row.coefficient == "C_Z" and row.log == other)
    assert lift.r2_after > lift.r2_before


def test_two_flights_of_the_twin_otter_agree_within_their_bounds_where_any_fit_lets_them() -> None:
    rows: list[dict[tuple[str, str], DerivativeRow]] = []
    slopes = []
    for name in ("totter_demo_018", "totter_lon_020213f1_017"):
        log = read(f"twin_otter/{name}.csv", "twin_otter.toml")
        result = close_loop([log], load_aircraft("twin_otter"), settings=BY_LIKELIHOOD)
        rows.append({(row.coefficient, row.term): row for row in result.derivatives if row.term != "1"})
        slopes.append(lift_slope(log))
    apart = {}
    for key, one in rows[0].items():
        other = rows[1].get(key)
        if other is not None and one.std_error and other.std_error:
            apart[key] = abs(one.value - other.value) / np.hypot(one.std_error, other.std_error)
    # Equation error of this test's own finds another C_Z_alpha on each flight as well, 6 % apart: it is in the data.
    assert abs(slopes[0] - slopes[1]) > 0.3
    # Of the six others the largest passes 2.63 once in twenty if the bounds are true (Sidak); 2.13 was measured.
    assert {key for key, distance in apart.items() if distance > 2.63} <= {("C_Z", "alpha")}
    assert len(apart) >= 7


def lift_slope(log: FlightLog) -> float:
    """C_Z_alpha by equation error on the recorded channels."""
    aircraft = load_aircraft("twin_otter")
    q_bar = 0.5 * log["rho"] * log["V"] ** 2
    force = log["mass"] * log["a_z"] / (q_bar * aircraft.wing_area)
    matrix = np.column_stack([np.ones(log.time.size), log["alpha"], log["q"], log["delta_e"]])
    return float(np.linalg.lstsq(matrix, force, rcond=None)[0][1])


def test_the_hfb_320_contradicts_itself_in_a_x_and_theta() -> None:
    # Known of this recording: a_x, theta and V disagree by about -0.11 m/s^2, which a bias of theta explains as well.
    log = read("hfb320/hfb320_1_10.asc", "hfb320.toml")
    result = close_loop([log], load_aircraft("hfb320"), settings=BY_LIKELIHOOD)
    named = [*result.effects, *result.alternatives]
    values = {(effect.kind, effect.where): effect.value for effect in named}
    # Which of the two stands in the effects and which among the alternatives no flight could say.
    assert values["sensor_bias", "a_x"] == pytest.approx(-0.11, abs=0.05)
    assert values["sensor_bias", "theta"] == pytest.approx(0.0115, abs=0.005)
    assert 0.1 < values["sensor_delay", "alpha"] < 0.25
    theta = next(row for row in result.errors if row.channel == "theta")
    assert theta.before is not None
    assert theta.after is not None
    assert theta.before > 0.0115
    assert theta.after < 0.0025


def test_the_citation_s_vane_lags() -> None:
    log = read("citation/seg_ref_20180312_shortperiod.csv", "citation.toml")
    result = close_loop([log], load_aircraft("citation"), settings=BY_LIKELIHOOD)
    late = [
        effect.value
        for effect in (*result.effects, *result.alternatives)
        if effect.where == "alpha" and effect.kind in ("sensor_lag", "sensor_delay")
    ]
    assert late
    assert all(0.15 < value < 0.5 for value in late)
    # In the moment an alphadot term looks the same; all channels together tell it from the vane's lag, and are said to.
    (alike,) = [note for note in result.notes if note.startswith("C_m alone cannot distinguish C_m alpha_dot_hat from")]
    assert "sensor_lag of alpha" in alike
    assert "All channels together favour the effect" in alike
    # Equation error on this flight: R^2 .904, and .992 with alpha taken .45 s earlier.
    moment = next(row for row in result.coefficients if row.coefficient == "C_m")
    assert moment.r2_before < 0.92
    assert moment.r2_after > 0.98


def test_the_attas_stalls_with_trim_and_thrust_in_its_moment() -> None:
    # Published of this flight: the flow separates at .31 rad (.2 to .4 with its delay), and C_m misses trim and thrust.
    log = read("attas/fAttas_qst01_withHeader.asc", "attas_stall.toml")
    settings = replace(BY_LIKELIHOOD, paper_chain=False, next_flight=False, linear_analysis=False)
    result = close_loop([log], load_aircraft("attas"), settings=settings)
    values = {(effect.kind, effect.where, effect.term): effect.value for effect in result.effects}
    assert values["flow_separation", "C_L", ""] == pytest.approx(0.3, abs=0.05)
    assert values["aero_term", "C_m", "delta_h"] < 0.0
    assert values["aero_term", "C_m", "C_T"] > 0.0
    # Free regression invents a C_L_q of 40: it is not named, and the slope of the lift is that of the 3-2-1-1.
    assert ("aero_term", "C_L", "q_hat") not in values
    assert derivative(result, "C_L", "alpha") == pytest.approx(5.226, rel=0.08)


def explanations(log: FlightLog) -> dict[tuple[str, str], InstrumentFinding]:
    """What kinematics find on a log, and what they cannot tell from it, by kind and channel."""
    agreement = check_kinematics([log])
    assert agreement is not None
    rows = [*agreement.findings, *(row for group in agreement.inseparable for row in group[1:])]
    return {(row.kind, row.where): row for row in rows}


def test_kinematics_alone_show_the_hfb_320_s_contradiction_as_a_drift_of_its_airspeed() -> None:
    """A bias of a_x of -0.11 m/s^2, or one of theta, explains it; so would a wind that changes by metres a second."""
    agreement = check_kinematics([read("hfb320/hfb320_1_10.asc", "hfb320.toml")])
    assert agreement is not None
    (note,) = [note for note in agreement.notes if note.startswith("V and the path drift apart")]
    assert "A constant bias equivalent to the mean drift: −0.13 m/s² of a_x or 0.013 rad of theta (86 %" in note
    row = next(row for row in agreement.channels if row.channel == "V")
    assert not row.noise * 5.0 > row.after > 1.0


@pytest.mark.parametrize("name", ["totter_demo_018", "totter_lon_020213f1_017"])
def test_kinematics_alone_show_the_twin_otter_s_late_vane_or_its_arm(name: str) -> None:
    found = explanations(read(f"twin_otter/{name}.csv", "twin_otter.toml"))
    late = [row.value for key, row in found.items() if key in {("sensor_delay", "alpha"), ("sensor_lag", "alpha")}]
    arms = [
        abs(row.value)
        for (kind, where), row in found.items()
        if kind == "sensor_position" and where in ("alpha", "a_z")
    ]
    assert late or arms
    assert all(0.015 < value < 0.035 for value in late)
    assert all(1.3 < value < 2.3 for value in arms)


def test_kinematics_alone_show_the_citation_s_slow_vane() -> None:
    found = explanations(read("citation/seg_ref_20180312_shortperiod.csv", "citation.toml"))
    assert 0.1 < found["sensor_lag", "alpha"].value < 0.5


@pytest.mark.parametrize(
    ("name", "channel_map"),
    [
        ("hfb320/hfb320_1_10.asc", "hfb320.toml"),
        ("twin_otter/totter_demo_018.csv", "twin_otter.toml"),
        ("twin_otter/totter_lon_020213f1_017.csv", "twin_otter.toml"),
        ("citation/seg_ref_20180312_shortperiod.csv", "citation.toml"),
        ("citation/phlab_ref_20180312_full_10Hz.csv.gz", "citation.toml"),
        ("attas/fAttasElv1.mat", "attas_mat.toml"),
        ("attas/fAttas_qst01_withHeader.asc", "attas_stall.toml"),
    ],
)
def test_no_channel_of_a_recorded_flight_contradicts_the_others_beyond_an_instrument_s_fault(
    name: str, channel_map: str
) -> None:
    recording = read_recording(read(name, channel_map))
    assert recording is not None
    assert not contradictions([recording])
