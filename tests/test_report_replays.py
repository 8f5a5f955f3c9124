"""Which candidates a report replays and tells, and that it keeps to its size."""

import json

import pytest
from report_studies import ANGLES, BODIES, SLING, make_dataset, make_study
from still_runs import simulate_still

from simcore.dataset import candidate_path, open_dataset
from simcore.report.candidates import as_data, candidates_of
from simcore.report.replays import embed, first_pair
from simcore.report.runs import read_run


def places(ds, names):
    """Coordinates of candidates by their names."""
    found = {each.item(): each for each in ds.candidate.stack(all=ds.candidate.dims)}
    return [tuple(found[name]["all"].item()) for name in names]


@pytest.mark.parametrize(
    ("outcome", "expected"),
    [
        # the best design's worst body, beside the one of its candidates that fell last
        (lambda place: {0: -0.9, 4: -0.3, 7: 0.7}[place["support_angle_deg"]]
         - 0.05 * (place["body"] == BODIES[1]), [(BODIES[1], 7), (BODIES[1], 4)]),
        # nothing fell: the one pressed most, which is the one of least margin
        (lambda place: 0.1 + 0.1 * place["support_angle_deg"], [(BODIES[0], 7), (BODIES[0], 0)]),
        # nothing held
        (lambda place: -0.9 + 0.1 * place["support_angle_deg"], [(BODIES[0], 7), (BODIES[0], 4)]),
        (lambda place: "blow_up", []),
        # all others failed
        (lambda place: 0.5 if place == {"body": BODIES[0], "support_angle_deg": 4} else "blow_up",
         [(BODIES[0], 4)]),
    ],
    ids=["threshold", "all_held", "all_fell", "all_failed", "one_left"],
)
def test_the_first_pair_is_the_best_beside_what_it_is_to_be_compared_with(
    tmp_path, outcome, expected
):
    ds = make_dataset(tmp_path, outcome, axes=ANGLES)
    assert places(ds, first_pair(ds)) == expected


def test_one_candidate_stands_alone(tmp_path):
    ds = make_dataset(tmp_path, lambda place: 0.5, bodies=BODIES[:1])
    assert first_pair(ds) == [ds.candidate.item()]


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    return simulate_still(folder, lambda place: 0.5, axes=ANGLES)


def test_replays_stop_where_the_room_ends(study):
    study, path = study
    ds, folder = open_dataset(path), study.folder / "candidates"
    names = [each.id for each in study.candidates]

    def embedded(first, room):
        return embed(ds, first, {}, folder, study.root, 40e3, room)

    whole = embedded(names[2:], 10**9)
    assert whole.runs == [names[2], *names[:2]]
    size = len(whole.assets().encode())
    assert embedded(names[2:], size + 1000).runs == whole.runs
    counts = []
    for short in (10**6, 20_000, 10_000, 5_000, 2_500, 1):
        some = embedded(names[2:], size - short)
        assert some.runs == whole.runs[: len(some.runs)]
        assert not some.runs or len(some.assets().encode()) <= size - short
        counts.append(len(some.runs))
    assert counts == sorted(counts) and counts[0] == 0 and counts[-1] == 2


def test_a_lost_run_is_left_out_and_the_others_are_replayed(study, tmp_path):
    study, path = study
    lost = candidate_path(study.folder / "candidates", study.candidates[0])
    kept = lost.read_bytes()
    lost.unlink()
    try:
        folder = study.folder / "candidates"
        runs = {lost.stem: read_run(lost, study.root)}
        assert "is missing" in runs[lost.stem]
        replays = embed(open_dataset(path), [], runs, folder, study.root, 40e3, 10**9)
        assert replays.runs == [each.id for each in study.candidates[1:]]
    finally:
        lost.write_bytes(kept)


def test_a_candidate_is_told_with_figures_margins_and_command(tmp_path):
    margins = {0: "blow_up", 4: -0.4, 7: 0.7}
    ds = make_dataset(tmp_path, lambda place: margins[place["support_angle_deg"]], axes=ANGLES)
    failed, fell, held = candidates_of(ds)[:3]
    assert failed["verdict"] == "failed" and failed["why"] == "made up to fail"
    assert failed["figures"] == failed["margins"] == []
    assert fell["mark"] == "✕" and ["Time of fall", "1.50 s"] in map(list, fell["figures"])
    told = dict(held["figures"])
    assert told["Fall margin"] == "0.70" and told["Contact area"] == "1,000 cm²"
    assert "Greatest strap tension" not in told  # a lift has no straps
    assert held["place"] == "male_172_70, support angle 7°"
    assert held["command"].endswith("--set support_angle_deg=7 --out run.nc")
    by_title = {title: rest for title, *rest in fell["margins"]}
    limit, text, share, part, over = by_title["Capillary closing, arteriolar end"]
    assert (limit, text, share, part, over) == ("4.3 kPa", "−5.56", -5.563, "sacrum", True)
    assert by_title["Moment of the neck"][1:] == ["0.80", 0.8, "", False]


def test_data_cannot_end_its_script():
    told = {"place": "</script><script>alert(1)</script><!--"}
    assert "<" not in as_data(told) and json.loads(as_data(told)) == told


def test_a_sling_is_told_with_its_straps(tmp_path):
    _, path = make_study(tmp_path, lambda place: 0.6, **SLING)
    (told,) = candidates_of(open_dataset(path))[:1]
    assert dict(told["figures"])["Greatest strap tension"] == "240 N"
