"""Batch processing: close-loop on a folder of manoeuvres, and tables of derivatives over them.

`logs` finds the logs, `one_log` processes one in a worker, `run` distributes them, `table` combines repeats.
"""

from aerosid.studies.batch.logs import LogFile, find_logs
from aerosid.studies.batch.run import Batch, run_batch
from aerosid.studies.batch.table import TableRow, derivative_table
from aerosid.studies.batch.writing import write_batch

__all__ = ["Batch", "LogFile", "TableRow", "derivative_table", "find_logs", "run_batch", "write_batch"]
