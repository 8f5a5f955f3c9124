"""Flesh over the bones: how thick and how stiff it is, by region of the body.

The table, tissue.csv, has a source and a confidence for each number; many are recalled or assumed
(docs/limits.md). Flesh is a layer on rigid bone: it knows its thickness and the modulus at small
strain, and no neighbours.
"""

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from simcore.body.regions import REGION_NAMES

TABLE = Path(__file__).with_name("tissue.csv")

REFERENCE_BMI = 23.0  # [kg/m²] of the adult in the table: 70 kg, 1.745 m
# ASSUME: flesh thins out over some 5 cm; the middle of the sacrum, 0.1 m wide, keeps its own.
SMOOTHING_LENGTH = 0.02  # [m]
REACH = 3.0  # in smoothing lengths; a Gaussian has 1 % of its weight beyond
STRAIN_MAX = 0.8
"""Strain beyond which Eq. S12 goes on linearly: flesh is 25 times as stiff there as at rest."""


@dataclass(frozen=True, eq=False)
class Tissue:
    """Flesh of regions (r,) or of skin vertices (n,).

    Attributes
    ----------
    thickness : ndarray
        From skin to bone, unloaded [m].
    modulus : ndarray
        Pressure over strain, where the strain is small [Pa].
    """

    thickness: np.ndarray
    modulus: np.ndarray


def region_tissue(body_mass_index: float = REFERENCE_BMI) -> Tissue:
    """Return the flesh of each of `REGION_NAMES` (r,).

    Parameters
    ----------
    body_mass_index : float
        Mass over squared stature [kg/m²]. At a given stature the area of every cross-section goes
        with the mass, so that widths, and flesh with them, go with its square root.
        ASSUME: where bone lies under the skin (`over_bone`) nothing grows; of the sacrum this is
        known to be false, see its note, but by how much beyond a BMI of 25 is not known.
    """
    rows = [rows_of_table()[_without_side(name)] for name in REGION_NAMES]
    growth = np.sqrt(body_mass_index / REFERENCE_BMI)
    return Tissue(
        np.array(
            [
                float(row["thickness_m"]) * (1.0 if row["over_bone"] == "yes" else growth)
                for row in rows
            ]
        ),
        np.array([float(row["modulus_pa"]) for row in rows]),
    )


def vertex_tissue(
    region_of_vertex: np.ndarray, body_mass_index: float = REFERENCE_BMI
) -> Tissue:
    """Return the flesh under each vertex (n,) from its index into `REGION_NAMES`, with jumps."""
    regions = region_tissue(body_mass_index)
    return Tissue(regions.thickness[region_of_vertex], regions.modulus[region_of_vertex])


def skin_tissue(
    region_of_vertex: np.ndarray,
    vertices: np.ndarray,
    normals: np.ndarray,
    vertex_area: np.ndarray,
    body_mass_index: float = REFERENCE_BMI,
) -> Tissue:
    """Return the flesh under each vertex (n,), smooth across the borders of regions.

    Parameters
    ----------
    region_of_vertex : (n,) int
    vertices, normals : (n, 3) float64
        Of the skin at rest, limbs apart [m]; outward unit normals.
    vertex_area : (n,) float64
        [m²].
    body_mass_index : float
        [kg/m²].
    """
    jumps = vertex_tissue(region_of_vertex, body_mass_index)
    mean = smoothing_operator(vertices, normals, vertex_area)
    return Tissue(mean @ jumps.thickness, mean @ jumps.modulus)


def smoothing_operator(
    vertices: np.ndarray,
    normals: np.ndarray,
    vertex_area: np.ndarray,
    length: float = SMOOTHING_LENGTH,
) -> csr_array:
    """Return the matrix (n, n) that replaces values of vertices by means around them.

    The weight of vertex j in the mean at i is A_j max(n_i · n_j, 0) exp(−‖x_i − x_j‖²/2ℓ²): an
    integral over the skin, so that it does not depend on how many vertices there are. The other
    side of a thin limb faces away and is no neighbour.

    Parameters
    ----------
    vertices, normals, vertex_area
        As for `skin_tissue`.
    length : float
        ℓ [m], several times the distance of neighbours or at least as long.
    """
    count = len(vertices)
    i, j = cKDTree(vertices).query_pairs(REACH * length, output_type="ndarray").T
    facing = np.einsum("kc,kc->k", normals[i], normals[j])
    i, j, facing = i[facing > 0], j[facing > 0], facing[facing > 0]
    apart = vertices[i] - vertices[j]
    weight = facing * np.exp(-np.einsum("kc,kc->k", apart, apart) / (2 * length**2))
    own = np.arange(count)
    rows, columns = np.concatenate([i, j, own]), np.concatenate([j, i, own])
    weights = np.concatenate([weight, weight, np.ones(count)]) * vertex_area[columns]
    sums = csr_array((weights, (rows, columns)), shape=(count, count))
    return csr_array(sums.multiply(1 / sums.sum(axis=1)[:, None]))


def linear_pressure(depth, tissue: Tissue):
    """Return the pressure p = E d/h of flesh that is pressed in by d [m]; [Pa]."""
    return tissue.modulus * np.maximum(depth, 0.0) / tissue.thickness


def stiffening_pressure(depth, tissue: Tissue):
    """Return the pressure p = E ε/(1 − ε), ε = d/h, of flesh that is pressed in by d [m]; [Pa].

    Eq. S12 of docs/sling.md, linear beyond `STRAIN_MAX`.
    """
    strain = np.maximum(depth, 0.0) / tissue.thickness
    bent = np.minimum(strain, STRAIN_MAX)
    return tissue.modulus * (bent / (1 - bent) + (strain - bent) / (1 - STRAIN_MAX) ** 2)


@cache
def rows_of_table() -> dict[str, dict[str, str]]:
    """Return the table as it is written, by region without side."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {row["region"]: row for row in csv.DictReader(file)}


def as_markdown() -> str:
    """Return the table as docs/limits.md has it."""
    lines = [
        "| region | mm | source | confidence | kPa | source | confidence | note |", 8 * "|---" + "|"
    ]
    lines += [
        f"| `{row['region']}` | {1e3 * float(row['thickness_m']):g} | {row['thickness_source']} |"
        f" {row['thickness_confidence']} | {1e-3 * float(row['modulus_pa']):g} |"
        f" {row['modulus_source']} | {row['modulus_confidence']} | {row['note']} |"
        for row in rows_of_table().values()
    ]
    return "\n".join(lines) + "\n"


def _without_side(name: str) -> str:
    return name.removesuffix("_left").removesuffix("_right")


if __name__ == "__main__":
    print(as_markdown(), end="")
