"""The field: what each route carries for a radar, as paths, and how wrong their sum may be."""
