"""Names in `echousd.draw.views` and values with which cameras are looked for at a dozen places, not two hundred."""

FEW = {"STEPS": (0.5, 1.6), "ALONG": (0.5,), "LOOKED": 12, "CHOSEN": 1}
