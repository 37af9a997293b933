"""Where waves go: from a geometry and a prune rule to routes, without any field."""
