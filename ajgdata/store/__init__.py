"""Files: the only layer that opens WAV, HDF5, CSV, YAML and JSON."""
