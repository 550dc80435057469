"""Produces raw recordings: a source plays and listens, the writer makes a session of it."""
