# Rows → dataset → frames of exemplars → report.


rule dataset:
    input:
        study=STUDY.path,
        rows=expand(f"{RESULTS}/jobs/{{job}}.nc", job=JOBS),
    output:
        f"{RESULTS}/dataset.nc",
    params:
        candidates=[each.id for each in STUDY.runs],
        judgement=judgement_digest(),
    script:
        "../scripts/dataset.py"


# Only now it is known which candidates are shown. A small study has kept their frames already.
rule frames:
    input:
        study=STUDY.path,
        dataset=f"{RESULTS}/dataset.nc",
    output:
        f"{RESULTS}/shown.txt",
    params:
        digest=presentation_digest(),
    script:
        "../scripts/frames.py"


rule report:
    input:
        f"{RESULTS}/dataset.nc",
        f"{RESULTS}/shown.txt",
    output:
        f"{RESULTS}/report.html",
    params:
        digest=presentation_digest(),
    script:
        "../scripts/report.py"
