"""Training of the compact echo model: data in tensors, one module per stage, one trainer."""
