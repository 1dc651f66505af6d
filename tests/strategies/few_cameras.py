"""Names in `echousd.draw.views` and values with which cameras are looked for at a dozen places, not two hundred."""

FEW = {"STEPS": (0.5, 1.6), "ALONG": (0.5,), "OFFS": (0.4, -0.7), "NEARS": (1.25, 2.0), "LOOKED": (6, 24)}
