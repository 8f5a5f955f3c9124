# Rows → dataset → report.


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


rule report:
    input:
        f"{RESULTS}/dataset.nc",
    output:
        f"{RESULTS}/report.html",
    params:
        digest=presentation_digest(),
    script:
        "../scripts/report.py"
