"""What hypothesis draws: texts of terms, aircraft files."""

from __future__ import annotations

from hypothesis import strategies as st

NAMES = ("alpha", "q_hat", "V_hat", "alpha_dot_hat", "C_T", "mach", "delta_e", "beta", "delta_f", "rho", "vane_2")

spaces = st.sampled_from(["", " ", "  ", "\t"])


@st.composite
def factor_texts(draw: st.DrawFn) -> str:
    """One factor in some spelling."""
    name = draw(st.sampled_from(NAMES))
    shape = draw(st.sampled_from(["1", "plain", "plain", "abs", "pos", "pos offset"]))
    gap = draw(spaces)
    if shape == "1":
        base = "1"
    elif shape == "plain":
        base = name
    elif shape == "pos offset":
        number = draw(st.one_of(st.floats(0.0, 50.0).map(repr), st.sampled_from([".5", "2.", "3", "1e-5", "007"])))
        base = f"pos({gap}{name}{gap}{draw(st.sampled_from('+-'))}{gap}{number})"
    else:
        base = f"{shape}{gap}({name}{gap})"
    power = draw(st.integers(1, 3))
    return base if power == 1 and draw(st.booleans()) else f"{base}{gap}^{gap}{power}"


@st.composite
def term_texts(draw: st.DrawFn) -> str:
    """A product of one to three factors, at most the ninth power of any variable."""
    gap = draw(spaces)
    return gap + f"{gap}*{gap}".join(draw(st.lists(factor_texts(), min_size=1, max_size=3))) + gap


@st.composite
def aircraft_texts(draw: st.DrawFn) -> str:
    """An aircraft file in some legal layout, with comments."""
    number = st.floats(-50.0, 50.0).map(lambda value: repr(round(value, 6)))
    positive = st.floats(0.01, 1e5).map(repr)
    lift = draw(st.booleans())
    inline = draw(st.booleans())
    lines = ["# a comment of the engineer", "schema = 1"]
    derivatives = []
    for coefficient in ("C_D", "C_L", "C_m") if lift else ("C_X", "C_Z", "C_m"):
        fewest = 1 if coefficient == "C_D" else 0  # lift and drag may not both be empty
        names = st.sampled_from(["1", "alpha", "q_hat", "delta_e", "alpha*alpha"])
        terms = draw(st.lists(names, unique=True, min_size=fewest, max_size=4))
        entries = []
        for term in terms:
            sigma = f", sigma = {draw(positive)}" if draw(st.booleans()) else ""
            fixed = ", fixed = true" if draw(st.integers(0, 4)) == 0 else ""
            entries.append(f'"{term}" = {{ value = {draw(number)}{sigma}{fixed} }}')
        if inline:
            derivatives.append(f"{coefficient} = {{ {', '.join(entries)} }}  # why {coefficient}")
        else:
            derivatives += [
                f"[derivatives.{coefficient}]  # why {coefficient}",
                *(f"{entry}  # why" for entry in entries),
                "",
            ]
    lines += ["", "[aircraft]", 'name = "drawn"', "", "[reference]", f"wing_area = {draw(positive)}  # m^2"]
    lines += [f"mean_chord = {draw(positive)}", "[mass]", f"mass = {draw(positive)}", f"I_yy = {draw(positive)}"]
    if draw(st.booleans()):
        lines += ["[thrust]", f"force = {draw(number)}"]
    lines += ["", *(["[derivatives]"] if inline else []), *derivatives]
    if draw(st.booleans()):
        lines += ["[[effects]]", 'kind = "control_lag"', 'where = "delta_e"', f"value = {draw(positive)}  # s"]
    if draw(st.booleans()):
        lines += ["[candidates]", 'C_m = ["alpha^2", "alpha*delta_e"]']
    return "\n".join(lines) + "\n"
