"""The command line: options, exit codes, progress."""
