"""Schemas and tables on the disk are what the models say, and every shipped file meets them."""

import json
import re

import jsonschema
import pytest
from tiny_project import ROOT

from simcore.config import load_study, read_design
from simcore.config.designs import DEVICES
from simcore.config.reference import BEGIN, FILES, rows, schemas, with_tables
from simcore.config.yaml_file import read_yaml

SCHEMAS = ROOT / "workflow" / "schemas"
README = ROOT / "config" / "README.md"
PLACES = {
    "study": "config",
    "robotic_lift": "designs/devices",
    "sling_lift": "designs/devices",
    "body": "designs/bodies",
    "posture": "designs/postures",
    "method": "designs/methods",
}
SHIPPED = [
    pytest.param(kind, path, id=f"{kind}-{path.stem}")
    for kind, place in PLACES.items()
    for path in sorted((ROOT / place).glob("*.yaml"))
    if kind not in DEVICES or read_yaml(path)["kind"] == kind
]
AGAIN = "run python -m simcore.config.reference"


@pytest.mark.parametrize("name", sorted(schemas()))
def test_schemas_are_current(name):
    assert (SCHEMAS / name).read_text(encoding="utf-8") == schemas()[name], AGAIN


def test_there_are_no_other_schemas():
    assert {path.name for path in SCHEMAS.iterdir()} == set(schemas())


def test_tables_are_current():
    text = README.read_text(encoding="utf-8")
    assert text == with_tables(text), AGAIN


@pytest.mark.parametrize(("kind", "path"), SHIPPED)
def test_shipped_files_meet_schema_and_model(kind, path):
    schema = json.loads((SCHEMAS / f"{kind}.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(read_yaml(path), schema)
    read_design(FILES[kind][0], path)


@pytest.mark.parametrize("kind", FILES)
def test_schemas_refuse_unknown_keys(kind):
    path = next(param.values[1] for param in SHIPPED if param.values[0] == kind)
    schema = json.loads(schemas()[f"{kind}.schema.json"])
    with pytest.raises(jsonschema.ValidationError, match="unheard_of"):
        jsonschema.validate(read_yaml(path) | {"unheard_of": 1}, schema)


@pytest.mark.parametrize("kind", FILES)
def test_every_key_is_told_in_full(kind):
    for path, accepts, unit, default, meaning in rows(FILES[kind][0]):
        assert accepts and accepts != "anything" and default and meaning, path
        assert unit or not re.search(r"_(m|s|kg|deg|hz|n|rad)\b", path), path


def test_example_of_the_readme(tmp_path):
    text = README.read_text(encoding="utf-8").partition(BEGIN)[0]
    (example,) = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    (tmp_path / "designs").symlink_to(ROOT / "designs")
    path = tmp_path / "example.yaml"
    path.write_text(example, encoding="utf-8")
    study = load_study(path)
    assert len(study.candidates) == 72
    assert "= 72 candidates" in text
    for name, values in study.axes.items():
        written = re.search(rf"{name.split('.')[-1]}: \{{.*# (.*)", example)
        if written:
            assert tuple(map(float, written[1].split(", "))) == values
    assert study.candidates[0].design.method.hold_s == 2
    assert study.candidates[0].design.posture.angles_deg["knee"]["flexion"] == 60
