# Each body is built once, before the jobs that share it.


rule body:
    input:
        STUDY.path,
    output:
        f"{RESULTS}/bodies/{{body}}.glb",
    params:
        study=STUDY.path,
        digest=simulation_digest(),
    script:
        "../scripts/body.py"
