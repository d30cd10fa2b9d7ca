"""What a closed loop leaves behind: result.json, tables, the report on page and paper, a summary on the terminal.

`result_schema` and `tables` are what scripts read. `sections` says what the report holds, each with a template in
templates/, and `figures` what it shows; `page` makes report.html of it and `paper` report.pdf. `writing` puts all files
in place at once.
"""

from aerosid.reporting.console import print_next_flight, print_summary
from aerosid.reporting.page import report_html
from aerosid.reporting.result_json import result_file
from aerosid.reporting.result_schema import ResultFile
from aerosid.reporting.writing import write_report

__all__ = ["ResultFile", "print_next_flight", "print_summary", "report_html", "result_file", "write_report"]
