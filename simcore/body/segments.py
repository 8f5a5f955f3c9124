"""The 18 segments and 47 degrees of freedom of the paper's skeleton, and what each is made of."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Segment:
    """One rigid segment and the joint that carries it.

    Attributes
    ----------
    name : str
        Segment name, which is also the name of its joint in the `pin.Model`.
    parent : str or None
        Parent segment; None for the root.
    joint : str
        "free" (translation + spherical), "spherical", "flexion" (revolute about +y) or
        "extension" (revolute about −y).
    anatomy : str
        Name of the anatomical joint, as used in postures.
    origin : tuple of str
        MakeHuman bones whose heads' mean is the joint centre.
    bones : tuple of str
        Prefixes of the MakeHuman bones merged into the segment.
    """

    name: str
    parent: str | None
    joint: str
    anatomy: str
    origin: tuple[str, ...]
    bones: tuple[str, ...]


HEAD_BONES = (
    "neck", "head", "jaw", "eye", "levator", "oculi", "orbicularis", "oris", "risorius",
    "special", "temporalis", "tongue",
)
TOES = ("toe1-1", "toe2-1", "toe3-1", "toe4-1", "toe5-1")
HAND_BONES = ("wrist", "metacarpal", "finger")

TRUNK = (
    # The root sits midway between the hip joint centres.
    Segment("pelvis", None, "free", "root", ("upperleg01.L", "upperleg01.R"),
            ("root", "pelvis", "spine05")),
    Segment("lumbar", "pelvis", "spherical", "lumbar", ("spine04",), ("spine04", "spine03")),
    Segment("thoracic", "lumbar", "spherical", "thoracic", ("spine02",),
            ("spine02", "spine01", "clavicle", "shoulder", "breast")),
    Segment("head", "thoracic", "flexion", "neck", ("neck01",), HEAD_BONES),
)


LEG = (
    ("thigh", "pelvis", "spherical", "hip", ("upperleg01",), ("upperleg",)),
    ("shank", "thigh", "flexion", "knee", ("lowerleg01",), ("lowerleg",)),
    ("foot", "shank", "spherical", "ankle", ("foot",), ("foot",)),
    ("toe", "foot", "extension", "toe", TOES, ("toe",)),
)
ARM = (
    ("upper_arm", "thoracic", "spherical", "shoulder", ("upperarm01",), ("upperarm",)),
    ("forearm", "upper_arm", "spherical", "elbow", ("lowerarm01",), ("lowerarm",)),
    ("hand", "forearm", "spherical", "wrist", ("wrist",), HAND_BONES),
)


def _limb(rows: tuple, side: str) -> tuple[Segment, ...]:
    mark = "." + side[0].upper()
    segments = []
    for name, parent, joint, anatomy, origin, bones in rows:
        above = parent if parent in ("pelvis", "thoracic") else f"{parent}_{side}"
        heads = tuple(bone + mark for bone in origin)
        segments.append(Segment(f"{name}_{side}", above, joint, f"{anatomy}_{side}", heads, bones))
    return tuple(segments)


# Depth first: with another order Pinocchio's mass matrix is wrong without a word
# (stack-of-tasks/pinocchio, issue 1897).
SEGMENTS = (
    *TRUNK, *_limb(ARM, "left"), *_limb(ARM, "right"), *_limb(LEG, "left"), *_limb(LEG, "right"),
)
SEGMENT_NAMES = tuple(segment.name for segment in SEGMENTS)
INDEX = {name: index for index, name in enumerate(SEGMENT_NAMES)}
PARENTS = tuple(-1 if s.parent is None else INDEX[s.parent] for s in SEGMENTS)


def kind_of(name: str) -> str:
    """Name of a segment or joint without its side."""
    return name.removesuffix("_left").removesuffix("_right")


def segment_of_bone(bone: str) -> int:
    """Index of the segment a MakeHuman bone is merged into.

    Raises
    ------
    KeyError
        If no segment lists the bone.
    """
    base, _, mark = bone.partition(".")
    for index, segment in enumerate(SEGMENTS):
        side = segment.name.rpartition("_")[2]
        if side in ("left", "right") and mark != side[0].upper():
            continue
        if base.startswith(segment.bones):
            return index
    raise KeyError(bone)
