"""Models that others wrote: Functional Mock-up Units (FMUs), FMI 2.0 and 3.0."""
