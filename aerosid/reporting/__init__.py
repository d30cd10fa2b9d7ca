"""What a closed loop leaves behind: result.json, tables, the report on one page, and a summary on the terminal.

`result_schema` and `tables` are what scripts read. `page` assembles report.html from `sections`, each of which is one
function here and one template in templates/; `charts` draws the figures and `inline_svg` sets them into the page.
`writing` puts all files in place at once.
"""

from aerosid.reporting.console import print_summary
from aerosid.reporting.page import report_html
from aerosid.reporting.result_schema import ResultFile, result_file
from aerosid.reporting.writing import write_report

__all__ = ["ResultFile", "print_summary", "report_html", "result_file", "write_report"]
