def process_mode():
    """Tell whether this process executes jobs: known when Snakemake builds their graph."""
    if not workflow.is_main_process:
        return "job"
    return "look" if workflow.executor_plugin is None or workflow.dryrun else "run"


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
        for session in PLANS[wildcards.dataset].sessions
    ]


def of_runs(path, tasks):
    """All evaluated models of some tasks, for one kind of file."""
    return [path(*run) for run in runs_of(SPECS, tasks)]


def of_experiments(tasks):
    """What else some tasks ask for."""
    return [one.path for one in documents_of(PATHS, SPECS, tasks)]


def declared(wildcards):
    """The task of a job, as it stands in dataset.yaml."""
    return PLANS[wildcards.dataset].spec.tasks[wildcards.task]


def solved_before(wildcards):
    """Whose responses a session finds, if it waits for them: the solver runs once a scene."""
    first = solved_by(PLANS, wildcards.dataset, wildcards.session)
    path = PATHS.audio_manifest(first, wildcards.session) if first else None
    return [INPUTS.of(first, path)] if first else []


def data_of(path, tasks):
    """Data sets that some tasks are about, for one kind of file."""
    return [path(name) for name in datasets_of(SPECS, tasks)]


def part(of):
    """What `of(tasks)` gives for the tasks of one experiment."""
    return lambda wildcards: of(EXPERIMENTS[wildcards.experiment])


def declared_embedding(wildcards):
    """The embedding of a job, as it stands in dataset.yaml."""
    return PLANS[wildcards.dataset].spec.embeddings[wildcards.embedding]


def embedding_settings(wildcards):
    """The same as plain values, defaults included."""
    return declared_embedding(wildcards).model_dump(mode="json")


def of_embeddings(embeddings):
    """What is measured of some embeddings."""
    return [
        PATHS.embedding_document(dataset, name, document)
        for dataset, name in embeddings
        for document in SPECS[dataset].embeddings[name].documents
    ]


def of_pictures(path):
    """All embeddings that have pictures, for one kind of file: those of one gripper."""
    return [
        path(dataset, name)
        for dataset, name in EMBEDDINGS
        if not PLANS[dataset].spec.embeddings[name].base
    ]
