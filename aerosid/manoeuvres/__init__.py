"""Manoeuvres in recordings: whole flights segmented into tests, trim points and turns by flight mechanics alone."""

from aerosid.manoeuvres.found import CONDITIONS, KINDS
from aerosid.manoeuvres.segmentation import FlightSegmentation, FoundManoeuvre, RejectedStretch, find_manoeuvres
from aerosid.manoeuvres.settings import FinderSettings
from aerosid.manoeuvres.whole_flight import longitudinal_cuts, longitudinal_manoeuvres, whole_flight_sentence

__all__ = [
    "CONDITIONS",
    "KINDS",
    "FinderSettings",
    "FlightSegmentation",
    "FoundManoeuvre",
    "RejectedStretch",
    "find_manoeuvres",
    "longitudinal_cuts",
    "longitudinal_manoeuvres",
    "whole_flight_sentence",
]
