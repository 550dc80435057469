"""Trained models as files for computers without this package: ONNX, and NumPy alone."""
