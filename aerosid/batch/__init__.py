"""The loop over a folder of manoeuvres, and tables of derivatives over them.

`logs` finds them, `one_log` is what a worker does with one, `run` gives them to workers, `table` puts repeats together.
"""

from aerosid.batch.logs import LogFile, find_logs
from aerosid.batch.run import Batch, run_batch
from aerosid.batch.table import TableRow, derivative_table
from aerosid.batch.writing import write_batch

__all__ = ["Batch", "LogFile", "TableRow", "derivative_table", "find_logs", "run_batch", "write_batch"]
