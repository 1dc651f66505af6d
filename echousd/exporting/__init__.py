"""A room as one file for other software: flat USD, usdz, glTF; a row of `FORMATS` each."""
