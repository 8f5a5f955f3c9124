# Each body is built once, before the jobs that share it.


def body_of(run):
    """Return the name of a body's file; one with twice the skin is another body."""
    twice = run.coordinates.get("variant") == "twice_skin"
    return run.coordinates["body"] + "_twice_skin" * twice


BODIES = {body_of(each): each.design.body for each in reversed(STUDY.runs)}


rule body:
    output:
        f"{RESULTS}/bodies/{{body}}.glb",
    params:
        design=lambda job: BODIES[job.body].model_dump_json(),
        digest=simulation_digest(),
    script:
        "../scripts/body.py"
