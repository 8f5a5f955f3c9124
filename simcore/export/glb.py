"""Binary glTF 2.0: a JSON chunk and a binary chunk, put together from numpy arrays.

Khronos Group, glTF 2.0 Specification, ISO/IEC 12113:2022; section numbers refer to it.
"""

import json
import struct

import numpy as np

COMPONENT = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126}  # 3.6.2.2
KIND = {(): "SCALAR", (2,): "VEC2", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963  # 5.11: vertices, indices


class Glb:
    """A glTF asset under construction; each `add` returns the index by which glTF refers to it."""

    def __init__(self, generator: str):
        self.tree = {"asset": {"version": "2.0", "generator": generator}}
        self._binary = bytearray()

    def add(self, kind: str, **entry) -> int:
        """Append an entry to one of the lists of the asset, such as `nodes`."""
        entries = self.tree.setdefault(kind, [])
        entries.append({key: value for key, value in entry.items() if value is not None})
        return len(entries) - 1

    def add_array(
        self, values: np.ndarray, target: int | None = None, bounds: bool = False,
        normalized: bool = False,
    ) -> int:
        """Append values (count, …) to the binary chunk and return their accessor.

        Parameters
        ----------
        values : np.ndarray
            uint8, uint16, uint32 or float32; matrices with columns first (3.6.2.4).
        target : int, optional
            `ARRAY_BUFFER` or `ELEMENT_ARRAY_BUFFER` of what a mesh refers to.
        bounds : bool
            Tell minimum and maximum, as positions and times must.
        normalized : bool
            Integers stand for shares of their largest value.
        """
        values = np.ascontiguousarray(values)
        self._binary += bytes(-len(self._binary) % 4)
        view = self.add(
            "bufferViews", buffer=0, byteOffset=len(self._binary), byteLength=values.nbytes,
            target=target,
        )
        self._binary += values.tobytes()
        ends = {"min": values.min(axis=0), "max": values.max(axis=0)} if bounds else {}
        return self.add(
            "accessors", bufferView=view, componentType=COMPONENT[values.dtype.str[1:]],
            count=len(values), type=KIND[values.shape[1:]], normalized=normalized or None,
            **{name: np.atleast_1d(end).tolist() for name, end in ends.items()},
        )

    def to_bytes(self) -> bytes:
        """Return the file (4.4)."""
        self._binary += bytes(-len(self._binary) % 4)
        tree = {**self.tree, "buffers": [{"byteLength": len(self._binary)}]}
        text = json.dumps(tree, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(self._binary), b"BIN\0") + bytes(self._binary)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
