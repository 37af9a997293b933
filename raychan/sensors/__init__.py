"""Sensors other than radar that share the ray caster."""
