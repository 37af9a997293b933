"""Random input for the commands: broken and odd scene files, meshes and flags. `python -m fuzz --help`."""
