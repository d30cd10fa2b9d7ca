"""Runs the command line as `python -m aerosid`."""

from aerosid.cli import main

if __name__ == "__main__":
    main()
