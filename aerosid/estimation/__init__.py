"""Maximum likelihood: output error and filter error, score tests, standard errors, open-loop comparison."""
