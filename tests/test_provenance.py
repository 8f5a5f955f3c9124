"""Digests follow what they are digests of."""

import pytest

from simcore import provenance


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package of a file a room; the digests are not kept from call to call."""
    names = ("report/select.js", "report/a.py", "report/a.html", "viewer/vendor/three.js",
             "viewer/viewer.css", "export/gltf.py", "pressure_scale.py", "scene.py", "notes.md")
    for name in names:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "shown", "decides"),
    [
        ("report/select.js", True, False),
        ("report/a.html", True, False),
        ("viewer/vendor/three.js", True, False),
        ("viewer/viewer.css", True, False),
        ("export/gltf.py", True, False),
        ("pressure_scale.py", True, False),
        ("scene.py", False, True),
        ("notes.md", False, False),
    ],
)
def test_what_shows_a_result_remakes_the_report_and_simulates_nothing(
    package, name, shown, decides
):
    def digests():
        return (provenance.presentation_digest.__wrapped__(),
                provenance.simulation_digest.__wrapped__())

    before = digests()
    (package / name).write_text("other")
    after = digests()
    assert (after[0] != before[0], after[1] != before[1]) == (shown, decides)
