"""The README as a package index shows it: its pictures and its links into the checkout have no public address."""

import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface

_LOCAL = re.compile(r"!?\[([^\]]*)\]\((?!https?:)[^)]*\)")


class Readme(MetadataHookInterface):
    """Gives the project's README with local pictures and links as their texts."""

    def update(self, metadata: dict) -> None:
        """Add the README to the project's metadata."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": _LOCAL.sub(r"\1", text)}
