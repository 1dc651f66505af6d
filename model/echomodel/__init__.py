"""The echo model: tensors in, tensors out. Imports neither pxr nor echousd; importing the package alone loads no torch."""
