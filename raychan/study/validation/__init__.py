"""Validation: the figures that a published study prints, compared one by one with the simulation."""
