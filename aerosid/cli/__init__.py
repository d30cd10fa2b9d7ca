"""Command-line interface: options, exit codes, progress."""
