"""Common code of renderers and path tracers: arguments, lifecycle, warnings of black pictures."""
