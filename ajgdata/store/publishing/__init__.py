"""Published data sets: one folder that Croissant, Hugging Face, Frictionless and xarray read.

All of its content follows from the feature file, the recordings and the declaration, in a fixed
order and without the current time, so the same inputs give the same bytes.
"""
