def process_mode():
    """Tell whether this process executes jobs: known when Snakemake builds their graph."""
    if not workflow.is_main_process:
        return "job"
    if workflow.executor_plugin is None or workflow.dryrun:
        return "look"
    if workflow.local_exec:
        # A limit of jobs a second lets Snakemake look at all waiting jobs again a second after
        # each look, in one chain of timers more for each job that ended: for nothing here.
        workflow.scheduling_settings.max_jobs_per_timespan = None
    note_this_run()
    return "run"


@cache
def note_this_run():
    """Note that this run is alive, once, and say if others are."""
    if said := note_run(PATHS, local=workflow.local_exec):
        print(said, file=sys.stderr)


def noted(wildcards):
    """No input: asked for before Snakemake locks anything, it notes the run."""
    with errors_stop_snakemake("project"):
        process_mode()
        spare_pandas()
    return []


def spare_pandas():
    """Let Snakemake compare parameters as the plain values that they are: to ask whether one is a
    table it would import pandas, a third of a second in every process."""
    plain = getattr(workflow.persistence, "_serialize_param_builtin", None)
    if plain:
        workflow.persistence._serialize_param_pandas = plain


def setting(name):
    """One key of the declaration of a job's data set, as plain values."""
    return lambda wildcards: SPECS[wildcards.dataset].model_dump(
        mode="json", include={name}
    )[name]


def session_files(wildcards):
    """Description and table of a session, as far as they are there: its job reports what is not."""
    name = wildcards.dataset, wildcards.session
    files = [PATHS.session_file(*name), PATHS.recordings_file(*name)]
    if wildcards.session in PLANS[wildcards.dataset].virtual:
        return [*files, PATHS.acquired(*name)]
    with errors_stop_snakemake(wildcards.dataset):
        return [file for file in files if file.is_file()]


def of_sessions(path):
    """All sessions of a data set, for one kind of file."""
    return lambda wildcards: [
        path(wildcards.dataset, session)
        for session in PLANS[wildcards.dataset].sessions
    ]


def asked(wildcards):
    """The experiment of a job, as its task asks for it."""
    return ASKED[wildcards.dataset, wildcards.task, wildcards.kind]


def documents_of(tasks):
    """Data set, task and kind of every result of some tasks."""
    return [key for key in ASKED if key[:2] in tasks]


def of_experiments(path, tasks):
    """Every result of some tasks, for one kind of file."""
    return [path(*key) for key in documents_of(tasks)]


def solved_before(wildcards):
    """Whose responses a session finds, if it waits for them: the solver runs once a scene."""
    first = solved_by(PLANS, wildcards.dataset, wildcards.session)
    return [PATHS.acquired(first, wildcards.session)] if first else []


def recipe_of_session(wildcards):
    """Hash of the settings of the recipe that a session follows from, and its source."""
    spec = SPECS[wildcards.dataset]
    settings = recipe_hash(spec.recipe, wildcards.session, spec.excitation)
    return [settings, SOURCES.origin(spec.recipe.source)]


def data_of(path, tasks):
    """Data sets that some tasks are about, for one kind of file."""
    return [path(name) for name in datasets_of(SPECS, tasks)]


def part(of):
    """What `of(tasks)` gives for the tasks of one report."""
    return lambda wildcards: of(REPORTS[wildcards.report])


def tables_of_page(wildcards):
    """What a page beside the report shows: of a study, of all ablations; the gallery has none."""
    if wildcards.page == ABLATIONS_PAGE:
        return [PATHS.ablation(name) for name in ABLATED]
    return [] if wildcards.page == GALLERY else [PATHS.study(wildcards.page)]


def registered_by(wildcards):
    """Packages that the models of a data set come from, with their versions, by model."""
    tasks = SPECS[wildcards.dataset].tasks.values()
    models = dict.fromkeys(model for task in tasks for model in task.models)
    return {model: MODELS.origin(model) for model in models}


def embedding_settings(wildcards):
    """The embedding of a job as plain values, defaults included."""
    declared = SPECS[wildcards.dataset].embeddings
    one = declared[wildcards.embedding]
    return one.model_dump(mode="json", exclude={"optional"})


def of_latents(path):
    """All embeddings that have latents of their own, for one kind of file."""
    return [path(*key) for key in LATENTS]


def measure_hash(wildcards):
    """Hash of the code that an experiment's results follow from; with the simulation for some."""
    one = asked(wildcards).experiment
    return layer_hash(
        "ablations" if one.renders else "evaluate",
        "pipeline/*record*.py",
        "pipeline/experiments.py",
        "pipeline/rendering.py",
        *measure_files(one.name),
    )


def rendered_from(wildcards):
    """The recipe whose scenes an experiment plays other sounds in, "" if it plays none."""
    recipe = SPECS[wildcards.dataset].recipe
    if not asked(wildcards).experiment.renders or recipe is None:
        return ""
    return settings_digest(recipe)


def encoders_of(wildcards):
    """What the encoders of an embedding made, and what training them took."""
    if not asked(wildcards).of_latents:
        return []
    key = wildcards.dataset, wildcards.task
    return [PATHS.latents(*key), PATHS.training_cost(*key)]


STARTED_S = time.monotonic()


def taken():
    """Return what this run took."""
    dag = workflow.dag
    jobs = [job for job in dag.jobs if not job.is_norun]
    needed = [job for job in jobs if dag.needrun(job)]
    ran = [job for job in needed if dag.finished(job)]
    lost = [job for job in needed if not dag.finished(job)]
    return effort(
        time.monotonic() - STARTED_S,
        len(ran),
        len(jobs) - len(needed),
        [Path(job.log[0]) for job in ran if job.rule.name == "features"],
        local=workflow.local_exec,
        whole=not lost,
    )


# Whose results are told first: the data set that waits for the fewest jobs.
FIRST = min(
    (name for name, spec in SPECS.items() if spec.tasks),
    key=lambda name: len(PLANS[name].sessions) + sum(key[0] == name for key in ASKED),
    default="",
)


def first_results(wildcards):
    """Priority of the jobs of one data set, so that a first result is there soon."""
    return int(wildcards.dataset == FIRST)


def is_to_report():
    """Tell whether this run is still to make the report."""
    to_make = {str(file) for job in workflow.dag.needrun_jobs() for file in job.output}
    return str(PATHS.report) in to_make


def begin_report():
    """Write the first page of a report that this run is to make, which grows with its results."""
    if is_to_report():
        from ajgdata.pipeline import growing  # templates, which no other run needs

        if workflow.touch:
            growing.discard(PATHS)
        else:
            growing.begin(PATHS, list(PLANS), MEASURED)


def stop_report():
    """Say on that page that there is no more to come, if there is not, and what failed."""
    if PATHS.growing.is_file() and is_to_report():
        from ajgdata.pipeline.growing import stop

        stop(PATHS, failed_jobs())


def failed_jobs():
    """Return a line for each job that ended in an error, with its log."""
    return [
        f"{job.rule.name} {' '.join(job.wildcards)}: {', '.join(job.log) or 'see above'}"
        for job in workflow.scheduler.failed
    ]


def tell_run():
    """Print what the run did, of all that was asked for, on the console; return its summary."""
    outputs = {str(file) for job in workflow.dag.jobs for file in job.output}
    keys = [key for key in ASKED if str(PATHS.experiment(*key)) in outputs]
    specs = {
        name: SPECS[name] for name in SPECS if str(PATHS.features(name)) in outputs
    }
    if specs:
        run = summarise(PATHS, specs, keys, report=str(PATHS.report) in outputs)
        told = [*lines(PATHS, run, failed_jobs()), effort_line(taken(), run.data)]
        print("", *told, "", sep="\n", file=sys.stderr, flush=True)
        return run
    return None


def end_run(run):
    """End a whole run that skipped a task with one line and exit code 1; the next run, too."""
    whole = any(job.rule.name == "complete" for job in workflow.dag.jobs)
    if whole and run and (line := skipped_line(run)):
        PATHS.complete.unlink(missing_ok=True)
        raise SystemExit(line)
