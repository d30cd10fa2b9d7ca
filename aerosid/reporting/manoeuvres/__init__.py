"""A flight's manoeuvres for people and programs: table, JSON, cuts, segment file and a page with a picture of each."""

from aerosid.reporting.manoeuvres.cuts import cut_name, write_segmentation
from aerosid.reporting.manoeuvres.listing import segmentation_json
from aerosid.reporting.manoeuvres.table import print_segmentation

__all__ = ["cut_name", "print_segmentation", "segmentation_json", "write_segmentation"]
