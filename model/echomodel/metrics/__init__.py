"""Measures: relations kept, room figures, sizes, and (shapes) reconstruction and set distances."""
