"""From samples to spectrum: checks of a recording and the feature, with numpy and scipy only."""
