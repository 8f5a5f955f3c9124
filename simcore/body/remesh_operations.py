"""Local operations of the even remesh, on arrays with room to grow.

All take `points` (room, 3), `faces` (room, 3) with −1 in removed triangles, `incident`
(room, MAX_VALENCE) and `valence` (room,) with the triangles of each vertex, and `counts`, the
numbers of points and triangles in use.  `sizes` (room,) is the target edge [m] at each vertex; that
of an edge is the mean of its ends'.  All work in place.
"""

import numpy as np

from simcore.body.scalar_product import dot
from simcore.compiled import compiled

MAX_VALENCE = 24
LONGEST, SHORTEST = 4 / 3, 4 / 5  # of the target edge; Botsch and Kobbelt (2004)


@compiled
def fill_incident(faces, incident, valence):
    """Fill `incident` and `valence` from the triangles."""
    for f in range(len(faces)):
        for k in range(3):
            v = faces[f, k]
            incident[v, valence[v]] = f
            valence[v] += 1


@compiled
def _attach(incident, valence, v, f):
    incident[v, valence[v]] = f
    valence[v] += 1


@compiled
def _detach(incident, valence, v, f):
    for i in range(valence[v]):
        if incident[v, i] == f:
            valence[v] -= 1
            incident[v, i] = incident[v, valence[v]]
            return


@compiled
def _face_with_edge(faces, incident, valence, a, b):
    """The triangle in which b follows a, and its third vertex; −1 when there is none."""
    for i in range(valence[a]):
        f = incident[a, i]
        for k in range(3):
            if faces[f, k] == a and faces[f, (k + 1) % 3] == b:
                return f, faces[f, (k + 2) % 3]
    return -1, -1


@compiled
def _replace(faces, f, old, new):
    for k in range(3):
        if faces[f, k] == old:
            faces[f, k] = new


@compiled
def _set(faces, f, a, b, c):
    faces[f, 0], faces[f, 1], faces[f, 2] = a, b, c


@compiled
def _cross(points, a, b, c):
    return np.cross(points[b] - points[a], points[c] - points[a])


@compiled
def split_long(points, faces, incident, valence, counts, sizes):
    """Halve every edge longer than LONGEST times its target."""
    f = 0
    while f < counts[1]:
        k = 0
        while k < 3:
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            span = points[a] - points[b]
            size = 0.5 * (sizes[a] + sizes[b])
            longest = LONGEST * size
            left, c = _face_with_edge(faces, incident, valence, a, b)
            right, d = _face_with_edge(faces, incident, valence, b, a)
            if (
                dot(span, span) > longest * longest
                and valence[c] < MAX_VALENCE
                and valence[d] < MAX_VALENCE
                and counts[0] < len(points)
                and counts[1] + 2 <= len(faces)
            ):
                m, new_left, new_right = counts[0], counts[1], counts[1] + 1
                counts[0] += 1
                counts[1] += 2
                points[m] = 0.5 * (points[a] + points[b])
                sizes[m] = size
                _set(faces, new_left, m, b, c)
                _set(faces, new_right, m, a, d)
                _replace(faces, left, b, m)
                _replace(faces, right, a, m)
                _detach(incident, valence, b, left)
                _detach(incident, valence, a, right)
                for g in (left, right, new_left, new_right):
                    _attach(incident, valence, m, g)
                _attach(incident, valence, b, new_left)
                _attach(incident, valence, c, new_left)
                _attach(incident, valence, a, new_right)
                _attach(incident, valence, d, new_right)
                k = 0
            else:
                k += 1
        f += 1


@compiled
def _shared_neighbours(faces, incident, valence, a, b):
    """Number of vertices joined by an edge to both a and b."""
    count = 0
    for i in range(valence[a]):
        for k in range(3):
            v = faces[incident[a, i], k]
            if v in (a, b) or faces[incident[a, i], (k + 2) % 3] != a:
                continue  # each neighbour is counted once: where it follows a
            for j in range(valence[b]):
                g = incident[b, j]
                if (faces[g, 0] == v or faces[g, 1] == v or faces[g, 2] == v) and v != b:
                    count += 1
                    break
    return count


@compiled
def _may_move(points, faces, incident, valence, v, other, target, longest):
    """Whether v may go to `target` without a long edge or a triangle turned over."""
    for i in range(valence[v]):
        f = incident[v, i]
        if faces[f, 0] == other or faces[f, 1] == other or faces[f, 2] == other:
            continue
        k = 0
        while faces[f, k] != v:
            k += 1
        p, q = points[faces[f, (k + 1) % 3]], points[faces[f, (k + 2) % 3]]
        to_p, to_q = p - target, q - target
        if dot(to_p, to_p) > longest * longest or dot(to_q, to_q) > longest * longest:
            return False
        before, after = np.cross(p - points[v], q - points[v]), np.cross(to_p, to_q)
        if dot(before, after) <= 0.2 * np.sqrt((dot(before, before)) * (dot(after, after))):
            return False
    return True


@compiled
def collapse_short(points, faces, incident, valence, counts, sizes):
    """Merge the ends of edges shorter than SHORTEST times their target.

    The link condition (the ends share two neighbours) keeps the surface closed and its genus.
    """
    for f in range(counts[1]):
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            if a < 0:
                break
            span = points[a] - points[b]
            size = 0.5 * (sizes[a] + sizes[b])
            if dot(span, span) >= (SHORTEST * size) ** 2:
                continue
            left, c = _face_with_edge(faces, incident, valence, a, b)
            right, d = _face_with_edge(faces, incident, valence, b, a)
            if (
                valence[c] <= 3
                or valence[d] <= 3
                or valence[a] + valence[b] - 4 > MAX_VALENCE - 4
                or _shared_neighbours(faces, incident, valence, a, b) != 2
            ):
                continue
            middle = 0.5 * (points[a] + points[b])
            if not (
                _may_move(points, faces, incident, valence, a, b, middle, LONGEST * size)
                and _may_move(points, faces, incident, valence, b, a, middle, LONGEST * size)
            ):
                continue
            for g in (left, right):
                for v in (a, b):
                    _detach(incident, valence, v, g)
            _detach(incident, valence, c, left)
            _detach(incident, valence, d, right)
            faces[left] = -1
            faces[right] = -1
            for i in range(valence[b]):
                _replace(faces, incident[b, i], b, a)
                _attach(incident, valence, a, incident[b, i])
            valence[b] = 0
            points[a] = middle
            sizes[a] = size
            break


@compiled
def _flip_evens_valence(a, b, c, d):
    """Whether edge ab → cd brings the four valences nearer 6 (a and b lose one, c and d gain)."""
    before = abs(a - 6) + abs(b - 6) + abs(c - 6) + abs(d - 6)
    return abs(a - 7) + abs(b - 7) + abs(c - 5) + abs(d - 5) < before


@compiled
def flip_for_valence(points, faces, incident, valence, counts):
    """Flip edges where that brings valences nearer 6 and turns no triangle over."""
    for f in range(counts[1]):
        if faces[f, 0] < 0:
            continue
        for k in range(3):
            a, b = faces[f, k], faces[f, (k + 1) % 3]
            left, c = _face_with_edge(faces, incident, valence, a, b)
            right, d = _face_with_edge(faces, incident, valence, b, a)
            if not _flip_evens_valence(valence[a], valence[b], valence[c], valence[d]):
                continue
            if valence[a] <= 3 or valence[b] <= 3 or max(valence[c], valence[d]) >= MAX_VALENCE:
                continue
            joined, _ = _face_with_edge(faces, incident, valence, c, d)
            back, _ = _face_with_edge(faces, incident, valence, d, c)
            if joined >= 0 or back >= 0:
                continue
            old_left, old_right = _cross(points, a, b, c), _cross(points, b, a, d)
            new_left, new_right = _cross(points, a, d, c), _cross(points, d, b, c)
            mean = old_left + old_right
            mean /= np.sqrt(dot(mean, mean))
            if (
                dot(new_left, mean) < 0.5 * np.sqrt(dot(new_left, new_left))
                or dot(new_right, mean) < 0.5 * np.sqrt(dot(new_right, new_right))
            ):
                continue
            _set(faces, left, a, d, c)
            _set(faces, right, d, b, c)
            _detach(incident, valence, b, left)
            _attach(incident, valence, d, left)
            _detach(incident, valence, a, right)
            _attach(incident, valence, c, right)
            break


@compiled
def relax(points, faces, incident, valence, counts):
    """Move each vertex within its tangent plane to the area-weighted centre of its ring."""
    moved = points[: counts[0]].copy()
    for v in range(counts[0]):
        if valence[v] == 0:
            continue
        centre, normal, total = np.zeros(3), np.zeros(3), 0.0
        for i in range(valence[v]):
            f = incident[v, i]
            cross = _cross(points, faces[f, 0], faces[f, 1], faces[f, 2])
            area = np.sqrt(dot(cross, cross))
            centre += area * (points[faces[f, 0]] + points[faces[f, 1]] + points[faces[f, 2]]) / 3
            normal += cross
            total += area
        step = centre / total - points[v]
        normal /= np.sqrt(dot(normal, normal)) + 1e-30
        moved[v] += step - (dot(step, normal)) * normal
    points[: counts[0]] = moved
