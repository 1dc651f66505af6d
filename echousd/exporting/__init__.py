"""A room as one file for other software: flat USD, usdz, glTF; a row of `FORMATS` each."""

from echousd.exporting.formats import FORMATS, Format, export

__all__ = ["FORMATS", "Format", "export"]
