"""A glTF file of a box, to be changed and read."""

from __future__ import annotations

import base64
import json
import struct

import numpy as np
import pytest
import trimesh

from raychan.world.errors import SceneError
from raychan.world.mesh_files.mesh_io import load

BOX = trimesh.creation.box([1.0, 2.0, 3.0])  # 22 m2, 6 m3
TYPES = {"f": 5126, "b": 5120, "h": 5122, "H": 5123, "B": 5121}


class Gltf:
    """The header of a glTF of a box, and its bytes."""

    def __init__(self):
        self.data = b""
        self.tree = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}
        corners = self.add(BOX.vertices, "f", "VEC3")
        self.tree["accessors"][corners] |= {"min": BOX.bounds[0].tolist(), "max": BOX.bounds[1].tolist()}
        self.primitive = {"attributes": {"POSITION": corners}, "indices": self.add(BOX.faces.ravel(), "H", "SCALAR")}
        self.node, self.mesh = {"mesh": 0, "name": "crate"}, {"name": "box", "primitives": [self.primitive]}
        self.tree |= {"nodes": [self.node], "meshes": [self.mesh], "scenes": [{"nodes": [0]}], "scene": 0}

    def add(self, values, kind, shape, **more):
        """Append an accessor of values, of a kind of `TYPES` and a shape as glTF names it; return its number."""
        raw = np.asarray(values).astype(f"<{kind}")
        rows = raw.reshape(len(raw), -1)
        step = -(-rows.itemsize * rows.shape[1] // 4) * 4 if shape == "VEC3" else rows.itemsize * rows.shape[1]
        packed = b"".join(row.tobytes().ljust(step, b"\0") for row in rows)
        self.data = self.data.ljust(-(-len(self.data) // 4) * 4, b"\0")
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(packed)}
        self.tree["bufferViews"].append(view | ({"byteStride": step} if shape == "VEC3" else {}))
        self.data += packed
        accessor = {"bufferView": len(self.tree["bufferViews"]) - 1, "componentType": TYPES[kind], "count": len(raw)}
        self.tree["accessors"].append(accessor | {"type": shape} | more)
        return len(self.tree["accessors"]) - 1

    def read(self, folder, ending="glb", uri=None):
        """Write the file into a folder and return its mesh; its buffer is the file's own, or that of a URI."""
        file = folder / f"m.{ending}"
        buffer = {"byteLength": len(self.data)}
        if uri is not None:
            buffer["uri"] = uri
        elif ending == "gltf":
            buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        text = json.dumps(self.tree | {"buffers": [buffer]}).encode()
        text, data = (x + fill * (-len(x) % 4) for x, fill in ((text, b" "), (self.data, b"\0")))
        if ending == "glb":
            head = struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
            text = (
                head + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
            )
        file.write_bytes(text)
        return load(file)


def refused(form, folder, ending):
    """Change the file by `form` and read it from a folder; return the words by which it is refused, with its name."""
    made = Gltf()
    form(made)
    with pytest.raises(SceneError) as told:
        made.read(folder, ending)
    assert f"m.{ending}" in str(told.value)
    return str(told.value)
