"""Runs the command line as `python -m aerosid`."""

import sys

from aerosid.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
