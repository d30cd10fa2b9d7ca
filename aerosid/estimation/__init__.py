"""Maximum likelihood: output error and filter error, score tests, deviations, open-loop comparison."""
