"""Published data sets: one folder that Croissant, Hugging Face, Frictionless and xarray read.

Everything in it follows from the feature store, the recordings and the declaration, in a fixed
order and without a clock: the same inputs give the same bytes.
"""
