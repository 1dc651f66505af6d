"""A room written as USD: its layers, assets, materials, physics, lights and cameras."""
