"""The patient: MakeHuman surface, 18-segment skeleton, inertia and blended skin (docs/body.md).

The names below load their module when first used: names and regions need no heavy import.
"""

from importlib import import_module

_HOME = {
    "Body": "build",
    "build_body": "build",
    "check_body": "reach",
    "describe_body": "describe",
    "write_glb": "describe",
    "configuration": "posture",
    "joint_angles": "posture",
}
__all__ = list(_HOME)


def __getattr__(name: str):
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
