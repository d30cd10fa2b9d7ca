"""Batch processing: the loop over a folder of manoeuvres, and tables of derivatives over them.

`logs` finds them, `one_log` is what a worker does with one, `run` gives them to workers, `table` puts repeats together.
"""

from aerosid.studies.batch.logs import LogFile, find_logs
from aerosid.studies.batch.run import Batch, run_batch
from aerosid.studies.batch.table import TableRow, derivative_table
from aerosid.studies.batch.writing import write_batch

__all__ = ["Batch", "LogFile", "TableRow", "derivative_table", "find_logs", "run_batch", "write_batch"]
