"""From samples to spectrum: checks, alignment and the feature itself; numpy and scipy only."""
