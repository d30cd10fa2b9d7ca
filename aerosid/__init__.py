"""aerosid finds what an aircraft's declared model lacks, from measured manoeuvres."""

__version__ = "0.1.0"
