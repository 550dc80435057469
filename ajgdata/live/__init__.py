"""A trained model in use: predict, sense, sort, show; and what watches it while it works."""
