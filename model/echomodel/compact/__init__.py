"""The compact echo model: small enough for a CPU, conditioned on the latent graph as the paper says."""
