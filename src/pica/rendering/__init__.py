"""What renderers and path tracers share: arguments, lifecycle, warnings of black pictures."""
