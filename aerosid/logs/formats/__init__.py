"""One file a recorder format, each a function from the file's bytes to a `Recording`."""
