# A study (config/*.yaml) → its candidates → dataset → report. Run by `make sweep`.
from pathlib import Path

from simcore.config import load_study
from simcore.jobs import jobs_of
from simcore.provenance import judgement_digest, presentation_digest, simulation_digest

if not workflow.output_settings.dryrun:  # the console shows what fails, the log file everything
    for handler in logger.handlers:
        if not hasattr(handler, "baseFilename"):
            handler.setLevel("WARNING")

STUDY = load_study(Path(config.get("study", "config/lift_angle.yaml")))
JOBS = jobs_of(STUDY)
RESULTS = f"results/{STUDY.name}"


rule all:
    input:
        f"{RESULTS}/dataset.nc",
        f"{RESULTS}/report.html",


onstart:
    from simcore.sweep import begin_count  # slow to import, and needed only where a job will run

    begin_count(STUDY)


include: "workflow/rules/bodies.smk"
include: "workflow/rules/candidates.smk"
include: "workflow/rules/results.smk"
