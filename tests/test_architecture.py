"""The walls of the house (docs/architecture.md)."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "simcore"
SOURCES = sorted(PACKAGE.rglob("*.py"))
SCRIPTS = sorted((ROOT / "workflow").rglob("*.py"))

SIBLINGS = ("body", "device", "contact", "dynamics", "sheet")
KERNELS = {"compiled", "fused", "inlined", "reassociated"}
FOUNDATION = {"errors", "cache", "compiled", "four", "config"}
JOINTS = ("scene", "skin_contact", "point_contact", "foundation_contact", "joint_torque",
          "interaction", "sling_contact", "sling_interaction", "recorder", "simulate",
          "joint_metrics", "region_metrics", "metrics", "frames", "dataset", "sweep", "certificate",
          "validation", "export", "viewer", "report", "cli")
"""What joins the rooms below, in the direction of the data: each may import those before it."""

JOIN_DATASETS = ("frames.py", "dataset.py", "sweep.py", "certificate.py")


SHARED = ("drawing", "energy", "limits", "pressure", "pressure_scale", "provenance")
"""Know no other room, but for the decorator of kernels."""


def room_of(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports_of(path):
    """Full names of all modules that a file imports, anywhere in it."""
    names = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names += [node.module, *(f"{node.module}.{each.name}" for each in node.names)]
    return names


def rooms_imported(path):
    named = {name.split(".")[1] for name in imports_of(path) if name.startswith("simcore.")}
    return named & {room_of(each) for each in SOURCES} - {room_of(path)}


def importers_of(library):
    return {
        str(path.relative_to(PACKAGE)) for path in SOURCES
        if any(name.split(".")[0] == library for name in imports_of(path))
    }


def test_the_walls_are_there():
    rooms = {room_of(path) for path in SOURCES}
    assert rooms >= {*SIBLINGS, *FOUNDATION, *JOINTS, *SHARED}
    assert "body" in rooms_imported(PACKAGE / "scene.py")
    assert importers_of("pinocchio")


@pytest.mark.parametrize("room", SIBLINGS)
def test_rooms_of_the_ground_floor_stand_apart(room):
    for path in SOURCES:
        if room_of(path) == room:
            assert rooms_imported(path) <= FOUNDATION, path


@pytest.mark.parametrize("room", ["contact", "dynamics"])
def test_contact_and_dynamics_know_no_designs(room):
    for path in SOURCES:
        if room_of(path) == room:
            assert rooms_imported(path) <= {"errors", "compiled", "four"}, path


def test_errors_and_cache_know_nothing_and_config_only_errors():
    assert not rooms_imported(PACKAGE / "errors.py")
    assert not rooms_imported(PACKAGE / "cache.py")
    for path in SOURCES:
        if room_of(path) == "config":
            assert rooms_imported(path) <= {"errors"}, path


@pytest.mark.parametrize("room", JOINTS)
def test_data_flow_one_way(room):
    """Each joins only what lies below it; what is in no list, as a benchmark, is for cli alone."""
    below = {*FOUNDATION, *SIBLINGS, *SHARED, *JOINTS[: JOINTS.index(room)]}
    for path in SOURCES:
        if room_of(path) == room and room != "cli":
            assert rooms_imported(path) <= below, path
        if room_of(path) in SHARED:
            assert rooms_imported(path) <= {"compiled"}, path


def test_yaml_is_read_only_in_config():
    for library in ("ruamel", "yaml"):
        assert all(name.startswith("config/") for name in importers_of(library)), library


def test_xarray_and_netcdf_stay_with_the_dataset():
    for library in ("xarray", "netCDF4", "h5netcdf"):
        for name in importers_of(library):
            assert name in JOIN_DATASETS or name.startswith("report/"), name


def test_snakemake_is_named_only_under_workflow():
    for path in SOURCES:
        assert "snakemake" not in path.read_text(encoding="utf-8").lower(), path


def test_workflow_scripts_are_thin():
    assert SCRIPTS
    for path in SCRIPTS:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 30, path


def test_kernels_read_nothing_of_files_without_kernels():
    """What is compiled into them is then of the sources that their cache is named by."""
    for path in SOURCES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        origin = {
            alias.asname or alias.name: node.module
            for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)
            for alias in node.names if node.module.startswith("simcore.")
        }
        read = [node for node in tree.body if isinstance(node, ast.Assign)] + [
            node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
            and any(ast.unparse(each) in KERNELS for each in node.decorator_list)
        ]
        if not any(isinstance(node, ast.FunctionDef) for node in read):
            continue
        for name in {each.id for node in read for each in ast.walk(node)
                     if isinstance(each, ast.Name)} & origin.keys():
            source = ROOT.joinpath(*origin[name].split(".")).with_suffix(".py")
            # A name of a package is a module of it.
            source = source if source.exists() else source.with_suffix("") / f"{name}.py"
            assert "compiled" in source.read_text(encoding="utf-8"), (path, name)


def test_no_file_is_long():
    for path in [*SOURCES, *SCRIPTS]:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 400, path


def test_no_drawer_for_leftovers():
    for path in SOURCES:
        assert path.stem not in ("utils", "util", "helpers", "helper", "common", "misc", "manager")
