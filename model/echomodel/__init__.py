"""The echo model: tensors in, tensors out. Knows neither pxr nor echousd; importing the package loads no torch."""
