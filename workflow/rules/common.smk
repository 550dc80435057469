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
    """Tables of a page beside the report: of a study or of all ablations."""
    if wildcards.page == ABLATIONS_PAGE:
        return [PATHS.ablation(name) for name in ABLATED]
    return [PATHS.study(wildcards.page)]


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
