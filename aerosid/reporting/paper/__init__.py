"""The report on A4: the same sections as the page, typeset by reportlab.

`elements` parses a section's HTML to a tree, `blocks` turns it into paragraphs, tables and figures, `tables` sets the
width of columns, `typeface` defines fonts and colours, and `document` puts them on numbered pages.
"""

from aerosid.reporting.paper.document import page_pdf, report_pdf
from aerosid.reporting.paper.typeface import registered as load_typeface

__all__ = ["load_typeface", "page_pdf", "report_pdf"]
