# Each body is built once, before the jobs that share it.


BODIES = {each.coordinates["body"]: each.design.body for each in reversed(STUDY.candidates)}


rule body:
    output:
        f"{RESULTS}/bodies/{{body}}.glb",
    params:
        design=lambda job: BODIES[job.body].model_dump_json(),
        digest=simulation_digest(),
    script:
        "../scripts/body.py"
