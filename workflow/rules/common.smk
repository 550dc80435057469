def process_mode():
    """Tell whether this process executes jobs: known when Snakemake builds their graph."""
    if not workflow.is_main_process:
        return "job"
    if workflow.executor_plugin is None or workflow.dryrun:
        return "look"
    if workflow.local_exec:
        # With a limit, Snakemake examines all waiting jobs again one second after each examination,
        # in one more chain of timers per finished job.
        workflow.scheduling_settings.max_jobs_per_timespan = None
    correct_dates()
    return "run"


@cache
def correct_dates():
    """Correct results with dates in the future, once, and report this."""
    if message := dates_mended(PATHS):
        print(message, file=sys.stderr)


INPUTS = Inputs(PATHS, PLANS, process_mode, scratch=workflow.snakemake_tmp_dir)


def code_of(*entries):
    """Digest of the code that a job may use, made for the jobs that are looked at."""
    return lambda wildcards: code_digest(*entries)


def setting(name):
    """One key of the declaration of a job's data set, as plain values."""
    return lambda wildcards: SPECS[wildcards.dataset].model_dump(
        mode="json", include={name}
    )[name]


def of_session(path):
    """The session of a job, for one kind of file."""
    return lambda wildcards: INPUTS.of(
        wildcards.dataset, path(wildcards.dataset, wildcards.session)
    )


def of_sessions(path):
    """All sessions of a data set, for one kind of file."""
    return lambda wildcards: [
        INPUTS.of(wildcards.dataset, path(wildcards.dataset, session))
        for session in declared(PLANS, wildcards.dataset).sessions
    ]


def declared(known, key):
    """What is known of a data set or an experiment. Ends the run if it is not declared: Snakemake
    would ignore another error if the file exists, and report that nothing is to be done.
    """
    if key not in known:
        name = key if isinstance(key, str) else " ".join(key)
        raise SystemExit(
            f"{name}: not declared in the data sets of this run; remove its results, or declare it"
        )
    return known[key]


def asked(wildcards):
    """The experiment of a job, as its task asks for it."""
    return declared(ASKED, (wildcards.dataset, wildcards.task, wildcards.kind))


def documents_of(tasks):
    """Data set, task and kind of every result of some tasks."""
    return [key for key in ASKED if key[:2] in tasks]


def of_experiments(path, tasks):
    """Every result of some tasks, for one kind of file."""
    return [path(*key) for key in documents_of(tasks)]


def solved_before(wildcards):
    """Whose responses a session finds, if it waits for them: the solver runs once a scene."""
    first = solved_by(PLANS, wildcards.dataset, wildcards.session)
    path = PATHS.audio_manifest(first, wildcards.session) if first else None
    return [INPUTS.of(first, path)] if first else []


def data_of(path, tasks):
    """Data sets that some tasks are about, for one kind of file."""
    return [path(name) for name in datasets_of(SPECS, tasks)]


def part(of):
    """What `of(tasks)` gives for the tasks of one report."""
    return lambda wildcards: of(REPORTS[wildcards.report])


def tables_of_page(wildcards):
    """Tables of a page beside the report: of a study or of all ablations."""
    if wildcards.page == ABLATIONS_PAGE:
        return [PATHS.ablation(name) for name in ABLATED]
    return [PATHS.study(wildcards.page)]


def opening_sessions(path):
    """Virtual sessions of the data set of the opening picture, for one kind of file."""
    return lambda wildcards: [
        INPUTS.of(OPENING.dataset, path(OPENING.dataset, session))
        for session in PLANS[OPENING.dataset].virtual
    ]


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


RUN_EXPERIMENT = "ajgdata.pipeline.experiments:run_experiment"
RENDERERS = [
    "ajgdata.pipeline.rendering:renderer",
    "ajgdata.pipeline.rendering:new_grasps_of",
]


def measured_by(wildcards):
    """What an experiment's results follow from, for `code_digest`; the simulation for some."""
    one = asked(wildcards).experiment
    return [
        RUN_EXPERIMENT,
        measure_entry(one.name),
        *([*RENDERERS, *GRIPPER_CODE] if one.renders else []),
    ]


def rendered_from(wildcards):
    """The recipe whose scenes an experiment plays other sounds in, "" if it plays none."""
    recipe = SPECS[wildcards.dataset].recipe
    if not asked(wildcards).experiment.renders or recipe is None:
        return ""
    return settings_digest(recipe)


def recordings_of(wildcards):
    """Where the recordings are, for an experiment that reads them."""
    if not asked(wildcards).experiment.reads_recordings:
        return []
    return of_sessions(PATHS.audio_manifest)(wildcards)


def sessions_of_others(wildcards):
    """Data set and session of the recordings of other data sets, for one that reads them."""
    one = asked(wildcards)
    others = one.others if one.experiment.reads_recordings else ()
    return [[other, session] for other in others for session in PLANS[other].sessions]


def recordings_of_others(wildcards):
    """Where these recordings are."""
    return [
        INPUTS.of(other, PATHS.audio_manifest(other, session))
        for other, session in sessions_of_others(wildcards)
    ]


def encoders_of(wildcards):
    """What the encoders of an embedding made, and what training them took."""
    if not asked(wildcards).of_latents:
        return []
    key = wildcards.dataset, wildcards.task
    return [PATHS.latents(*key), PATHS.training_cost(*key)]
