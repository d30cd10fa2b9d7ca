"""Running text: which names become symbols, and which are kept."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from aerosid.effects import KINDS
from aerosid.nomenclature import CHANNELS
from aerosid.reporting.prose import in_words, prose


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("C_m alpha^2 = -1.7", "Cm α2 = −1.7"),
        ("alpha*delta_e^2 in m/s^2", "α·δe2 in m/s²"),
        ("a control_lag of delta_e", "a control lag of δe"),
        ("turbulence, sigma_w = 0.8 m/s", "turbulence, σw = 0.8 m/s"),
        ("C_m_delta_e < 0 and I_yy", "Cmδe < 0 and Iyy"),
        ("by -2 ln L", "by −2 ln L"),
        ("C_D = 0.04 + C_L^2/(pi 8.44 0.8)", "CD = 0.04 + CL2/(pi 8.44 0.8)"),
        ("a 3-2-1-1 on 2026-11-22", "a 3-2-1-1 on 2026-11-22"),
    ],
)
def test_names_become_symbols(text: str, shown: str) -> None:
    assert Markup(prose(text)).striptags() == shown


@pytest.mark.parametrize(
    "text",
    [
        "flights/alpha/run_2.csv",
        "alpha.csv",
        "alpha_test.csv",
        "my_alpha",
        "next_input.csv",
        "light_transport_3211",
        "q",
    ],
)
def test_names_of_files_stay(text: str) -> None:
    assert str(prose(text)) == in_words(text) == text


def test_what_is_to_be_typed_is_kept() -> None:
    text = 'For alpha declare kind = "sensor_scale", where = "alpha", "-1 m/s^2" in [[effects]] of delta_e'
    typed = 'declare kind = "sensor_scale", where = "alpha", "-1 m/s^2" in [[effects]] of '
    assert Markup(prose(text)).striptags() == f"For α {typed}δe"
    assert in_words(text) == f"For alpha {typed}delta_e"


@given(st.text())
def test_nothing_becomes_an_element_that_is_not_ours(text: str) -> None:
    stripped = str(prose(text))
    for own in ("<var>", "</var>", "<sub>", "</sub>", "<sup>", "</sup>", "</span>", '<span class="formula">'):
        stripped = stripped.replace(own, "")
    assert "<" not in stripped
    assert ">" not in stripped


def test_no_kind_of_effect_keeps_an_underscore() -> None:
    for kind in KINDS:
        assert in_words(f"a {kind} of it") == f"a {kind.replace('_', ' ')} of it"


def test_every_channel_of_the_glossary_is_set() -> None:
    for name in CHANNELS:
        assert "_" not in Markup(prose(f"the {name}, so")).striptags()
