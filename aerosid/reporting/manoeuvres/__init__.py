"""A flight's manoeuvres as output: table, JSON, cuts, segment file and a page with a strip chart of each."""

from aerosid.reporting.manoeuvres.cuts import cut_name, write_segmentation
from aerosid.reporting.manoeuvres.listing import segmentation_json
from aerosid.reporting.manoeuvres.table import print_segmentation

__all__ = ["cut_name", "print_segmentation", "segmentation_json", "write_segmentation"]
