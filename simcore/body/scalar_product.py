"""The scalar product of two vectors of space, the same to the bit on every machine.

That of numpy's libraries goes by the processor, and where geometry is decided by a last bit, so
would meshes.
"""

from simcore.compiled import inlined


@inlined
def dot(a, b):
    """Return a · b of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
