"""Skin vertices that move with the same parts of the body, so that motions are told kind by kind.

A vertex counts with its one-ring, on which its normal rests.
"""

from dataclasses import dataclass

import numpy as np

from simcore.compiled import compiled


@dataclass(frozen=True, eq=False)
class SkinKinds:
    """The n vertices of a skin in k kinds.

    Attributes
    ----------
    star_offsets, star
        The vertices next to each, as CSR.
    kind : (n,) int64
    offsets : (k + 1,) int64, parts : (offsets[-1],) int64
        Parts of the body that each kind moves with.
    """

    star_offsets: np.ndarray
    star: np.ndarray
    kind: np.ndarray
    offsets: np.ndarray
    parts: np.ndarray


def skin_kinds(
    influence_offsets: np.ndarray, influence_part: np.ndarray, ring_offsets: np.ndarray,
    ring_next: np.ndarray,
) -> SkinKinds:
    """Return the kinds of a skin.

    Parameters
    ----------
    influence_offsets : (n + 1,), ring_offsets : (n + 1,), ring_next : (r, 2)
        As in `simcore.body.skin.Skin`.
    influence_part : (e,) int64
        Part of the body of each influence (`simcore.body.skin_listed.SkinParts`).
    """
    count = len(influence_offsets) - 1
    star_offsets, star = _stars(ring_offsets, ring_next)
    moves_with = np.zeros((count, influence_part.max() + 1), bool)
    owner = np.repeat(np.arange(count), np.diff(influence_offsets))
    moves_with[owner, influence_part] = True
    around = moves_with.copy()
    centre = np.repeat(np.arange(count), np.diff(star_offsets))
    np.logical_or.at(around, centre, moves_with[star])
    _, example, kind = np.unique(
        np.packbits(around, axis=1), axis=0, return_index=True, return_inverse=True
    )
    of_kind, parts = np.nonzero(around[example])
    offsets = np.searchsorted(of_kind, np.arange(len(example) + 1))
    return SkinKinds(star_offsets, star, kind.ravel(), offsets, parts)


@compiled
def _stars(ring_offsets, ring_next):
    """Return the vertices of each one-ring, each once, as CSR."""
    count = ring_offsets.size - 1
    starts, star = np.zeros(count + 1, np.int64), np.empty(2 * ring_next.shape[0] + 1, np.int64)
    seen, total = np.full(count, -1), 0
    for i in range(count):
        for e in range(ring_offsets[i], ring_offsets[i + 1]):
            for a in range(2):
                b = ring_next[e, a]
                star[total] = b
                total += seen[b] != i
                seen[b] = i
        starts[i + 1] = total
    return starts, star[:total].copy()


@compiled
def greatest_of_kinds(offsets, parts, of_part):
    """Return the greatest value of the parts of each kind (k,)."""
    greatest = np.zeros(offsets.size - 1)
    for k in range(greatest.size):
        for e in range(offsets[k], offsets[k + 1]):
            greatest[k] = max(greatest[k], of_part[parts[e]])
    return greatest


@compiled
def least_of_parts(offsets, parts, of_kind, count):
    """Return the least value of the kinds that each of so many parts belongs to, or infinity."""
    least = np.full(count, np.inf)
    for k in range(of_kind.size):
        for e in range(offsets[k], offsets[k + 1]):
            least[parts[e]] = min(least[parts[e]], of_kind[k])
    return least


@compiled
def parts_around(near_offsets, near, kind, kind_offsets, kind_parts, count):
    """Return the parts, of so many, that the vertices in each row move with, as CSR."""
    offsets, parts = np.zeros(near_offsets.size, np.int64), np.empty(16 * 1024, np.int64)
    kind_seen, part_seen = np.full(kind_offsets.size, -1), np.full(count, -1)
    total = 0
    for p in range(near_offsets.size - 1):
        while total + count >= parts.size:
            parts = np.concatenate((parts, parts))
        for e in range(near_offsets[p], near_offsets[p + 1]):
            k = kind[near[e]]
            if kind_seen[k] == p:
                continue
            kind_seen[k] = p
            for place in range(kind_offsets[k], kind_offsets[k + 1]):
                part = kind_parts[place]
                parts[total] = part
                total += part_seen[part] != p
                part_seen[part] = p
        offsets[p + 1] = total
    return offsets, parts[:total].copy()


LISTED, WITH_STAR = 1, 2
"""Bits of what is known of a vertex: it is listed, and so are the vertices next to it."""


@compiled
def list_around(rows, offsets, near, star_offsets, star, listed, count, known):
    """List the vertices in some rows and those next to them, each once.

    Parameters
    ----------
    rows : (r,) int64
    offsets : (p + 1,), near : (offsets[-1],) int64
        Vertices of all rows.
    star_offsets, star
        Of `SkinKinds`.
    listed : (n + 1,) int64
        The first `count` of them are listed; more are written behind these.
    known : (n,) uint8
        Bits of each vertex, all zero where none is listed; overwritten.

    Returns
    -------
    int
        How many are listed.
    """
    for p in rows:
        for e in range(offsets[p], offsets[p + 1]):
            i = np.uint64(near[e])
            if known[i] & WITH_STAR:
                continue
            listed[count] = i
            count += known[i] == 0
            known[i] = LISTED | WITH_STAR
            for place in range(star_offsets[i], star_offsets[i + 1]):
                s = np.uint64(star[place])
                listed[count] = s
                count += known[s] == 0
                known[s] |= LISTED
    return count
