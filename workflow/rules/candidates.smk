# A job simulates several candidates in one process; those already simulated by the present code
# are kept, so that a rerun costs only what is new.


rule simulate:
    input:
        lambda job: sorted({f"{RESULTS}/bodies/{body_of(each)}.glb" for each in JOBS[job.job]}),
    output:
        f"{RESULTS}/jobs/{{job}}.nc",
    params:
        study=STUDY.path,
        candidates=lambda job: [each.id for each in JOBS[job.job]],
        digest=simulation_digest(),
        trajectories=STUDY.file.trajectories,
    script:
        "../scripts/simulate.py"
